"""What a broker wants its share to send, compared with what the share says it sends.

Brokers never assume that a command arrived: a share may have started late or started again. They keep
the routes they want, compare them with PSHARE_OUTPUT_SUMMARY, and say again what is missing.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from pymoos_lite.field.routes import parse_output_summary

RETRY_AFTER = 3.0
"""Mission seconds before a missing route is asked for again; the share's summary takes up to one."""

_VARIABLE = re.compile(r"[^\s,&=]+\Z")


@dataclass(frozen=True, slots=True)
class Bridge:
    """A variable that is to travel, and the name it gets there."""

    source: str
    alias: str


def parse_bridge(text: str) -> Bridge:
    """``src=VAR[,alias=VAR]``.

    Raises:
        ValueError: it has another form.
    """
    values: dict[str, str] = {}
    for piece in "".join(text.split()).split(","):
        key, _, value = piece.partition("=")
        if key.lower() not in ("src", "alias") or not _VARIABLE.match(value):
            raise ValueError("expected src=VAR[,alias=VAR]")
        values[key.lower()] = value
    if "src" not in values:
        raise ValueError("expected src=VAR[,alias=VAR]")
    return Bridge(values["src"], values.get("alias", values["src"]))


@dataclass(frozen=True, slots=True)
class Route:
    """One variable on its way to one place, as PSHARE_CMD says it."""

    source: str
    alias: str
    place: str

    def command(self, verb: str = "output") -> str:
        return f"cmd={verb},src_name={self.source},dest_name={self.alias},route={self.place}"


class WantedRoutes:
    """The routes a broker wants."""

    def __init__(self) -> None:
        self._wanted: dict[Route, float] = {}
        self._unwanted: dict[Route, None] = {}
        self._standing: set[tuple[str, str, str]] = set()
        self._summary = ""
        self._settled = False

    def __len__(self) -> int:
        return len(self._wanted)

    def want(self, source: str, alias: str, place: str) -> None:
        """Add a route; wanting it again changes nothing."""
        route = Route(source, alias, place)
        self._unwanted.pop(route, None)
        if route not in self._wanted:
            self._wanted[route] = float("-inf")
            self._settled = False

    def drop(self, place: str) -> None:
        """Want nothing at `place` any more."""
        for route in [r for r in self._wanted if r.place == place]:
            del self._wanted[route]
            self._unwanted[route] = None

    def note_summary(self, text: str) -> None:
        """Take in a PSHARE_OUTPUT_SUMMARY."""
        if text == self._summary:
            return
        self._summary = text
        self._settled = False
        # Multicast places read group:port:multicast_N there and multicast_N in a command.
        self._standing = {
            (source, name, place.rpartition(":")[2] if "multicast_" in place else place)
            for source, name, place in parse_output_summary(text)
        }

    def missing(self) -> list[Route]:
        """Wanted routes that the share does not have."""
        standing = self._standing
        return [r for r in self._wanted if (r.source, r.alias, r.place) not in standing]

    def commands(self, now: float) -> list[str]:
        """The PSHARE_CMDs that are due."""
        if self._settled and not self._unwanted:
            return []
        out = [route.command("remove") for route in self._unwanted]
        self._unwanted.clear()
        missing = self.missing()
        self._settled = not missing
        for route in missing:
            if now - self._wanted[route] >= RETRY_AFTER:
                self._wanted[route] = now
                out.append(route.command())
        return out
