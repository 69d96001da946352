"""The host record: where a community can be reached (native_wire.md 4.2).

It travels in PHI_HOST_INFO, NODE_BROKER_PING and NODE_BROKER_ACK.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.text import fix, num, parse_number
from pymoos_lite.records.csp import MAX_TEXT, RecordError, clip

_RECORD = "host record"
_MAX_RECORD = 4096


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class HostRecord:
    """Where a community is.

    `iroutes` are the places it listens at, ``host:port`` or ``multicast_N``; `warp` None if not
    said; `key` is the number of the ping that an acknowledgement answers.
    """

    community: str
    hostip: str
    port_db: str
    port_udp: str = ""
    iroutes: tuple[str, ...] = ()
    keyword: str = ""
    hostip_alts: str = ""
    warp: float | None = None
    status: str = ""
    time: float | None = None
    key: str = ""
    id: str = ""

    @classmethod
    def parse(cls, text: str) -> HostRecord:
        """Record from text: tokens in any case and order, unknown ones ignored.

        Raises RecordError when it is too long, or community, hostip or port_db is missing or unusable.
        """
        if len(text) > min(_MAX_RECORD, MAX_TEXT):
            raise RecordError(_RECORD, f"text of {len(text)} characters is longer than {_MAX_RECORD}")
        f: dict[str, str] = {}
        for piece in text.split(","):
            key, equals, value = piece.partition("=")
            if equals:
                f[key.strip().lower()] = value.strip()
        community = f.get("community") or f.get("vname") or ""
        if not community or any(c.isspace() for c in community):
            raise RecordError(_RECORD, f"no community in '{clip(text)}'")
        hostip = f.get("hostip", "")
        if not is_host_address(hostip):
            raise RecordError(_RECORD, f"hostip must be a dotted quad or localhost, found '{clip(hostip)}'")
        if not f.get("port_db", "").isascii() or not f.get("port_db", "").isdigit():
            raise RecordError(_RECORD, f"port_db must be a number, found '{clip(f.get('port_db', ''))}'")
        iroutes = tuple(r for r in (r.strip() for r in f.get("pshare_iroutes", "").split("&")) if r)
        warp = parse_number(f.get("timewarp", ""))
        return cls(
            community=community,
            hostip=hostip,
            port_db=f["port_db"],
            port_udp=f.get("port_udp") or _port_of(iroutes),
            iroutes=iroutes,
            keyword=f.get("keyword", ""),
            hostip_alts=f.get("hostip_alts", ""),
            warp=warp if warp is not None and warp > 0.0 and isfinite(warp) else None,
            status=f.get("status", ""),
            time=parse_number(f.get("time", "")),
            key=f.get("key", ""),
            id=f.get("id", ""),
        )

    def to_text(self) -> str:
        """The record in the stock order, unset fields left out."""
        pairs = [
            ("community", self.community),
            ("hostip", self.hostip),
            ("port_db", self.port_db),
            ("port_udp", self.port_udp or _port_of(self.iroutes)),
            ("pshare_iroutes", "&".join(self.iroutes)),
            ("keyword", self.keyword),
            ("hostip_alts", self.hostip_alts),
            ("timewarp", "" if self.warp is None else num(self.warp, 6)),
            ("status", self.status),
            ("time", "" if self.time is None else fix(self.time, 2)),
            ("key", self.key),
            ("id", self.id),
        ]
        return ",".join(f"{key}={value}" for key, value in pairs if value)

    def __str__(self) -> str:
        return self.to_text()

    def routes_from(self, own_host: str) -> tuple[str, ...]:
        """The routes as somebody at `own_host` must use them: the record's `localhost` is not ours."""
        if own_host == self.hostip or self.hostip == "localhost":
            return self.iroutes
        return tuple(
            f"{self.hostip}{r[len('localhost') :]}" if r.startswith("localhost:") else r for r in self.iroutes
        )


def is_host_address(text: str) -> bool:
    """Whether `text` is a dotted quad or ``localhost``."""
    if text == "localhost":
        return True
    parts = text.split(".")
    return len(parts) == 4 and all(p.isascii() and p.isdigit() and len(p) < 4 and int(p) < 256 for p in parts)


def _port_of(iroutes: tuple[str, ...]) -> str:
    port = iroutes[0].rpartition(":")[2] if iroutes else ""
    return port if port.isascii() and port.isdigit() else ""
