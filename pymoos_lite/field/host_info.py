"""pHostInfo: finds out where this community can be reached and tells the brokers (marine_apps.md 8.1)."""

from __future__ import annotations

from collections.abc import Iterable

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.field.routes import parse_input_summary
from pymoos_lite.records.host_record import HostRecord, is_host_address

POST_EVERY = 10
"""Iterations between two posts of the same facts."""

_KIND_OF_INTERFACE = {"wifi": ("wl", "ath"), "wlan": ("wl",), "eth": ("eth", "en"), "usb": ("usb",)}


def _host(text: str) -> str:
    word = text.strip().lower()
    if not is_host_address(word):
        raise ValueError("expected a dotted quad or localhost")
    return word


@mypyc_attr(allow_interpreted_subclasses=True)
class HostInfo(App):
    """Posts PHI_HOST_INFO, at once when an address or an input of the share changes, else now and then."""

    DEFAULT_TICK = 1.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "default_hostip",
                "custom",
                "localhost",
                doc="Address to give when none is found.",
                aliases=("default_host_ip",),
                parse=_host,
            ),
            Parameter(
                "default_hostip_force",
                "custom",
                "",
                doc="Address to give whatever is found.",
                aliases=("default_host_ip_force",),
                parse=_host,
            ),
            Parameter(
                "prefer_interface",
                "text",
                "",
                doc="Interface whose address to give, if it has one: eth0, eth1, usb0 to usb2, wlan0, wifi, "
                "or any name of this machine.",
            ),
            Parameter("temp_file_dir", "text", "~/", doc="Accepted; no files are written."),
        )
    )

    def on_start_up(self) -> None:
        self._routes: list[str] = []
        self._found: list[tuple[str, str]] = []
        self._posted = ""
        self._rescan = True
        self._news = False

    def on_connect(self) -> None:
        self.register("HOST_INFO_REQUEST")
        self.register("PSHARE_INPUT_SUMMARY")
        self._posted = ""
        self._news = True

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == "PSHARE_INPUT_SUMMARY":
                if message.community == self.community:
                    self._routes = parse_input_summary(message.text)
                    self._news = True
            elif message.name == "HOST_INFO_REQUEST":
                self._rescan = True
                self._posted = ""

    def iterate(self) -> None:
        again = (self.iteration - 1) % POST_EVERY == 0
        if not (again or self._rescan or self._news):
            return
        if self._rescan or again:
            self._scan()
        self._rescan = self._news = False
        text = self.record().to_text()
        if text != self._posted or again:
            self._posted = text
            self._post(text)

    def record(self) -> HostRecord:
        """Where this community can be reached, as far as is known."""
        host = self.host()
        routes = tuple(f"{host}{r[9:]}" if r.startswith("localhost:") else r for r in self._routes)
        others = [address for _, address in self._found if address != host]
        return HostRecord(
            community=self.community,
            hostip=host,
            port_db=self.mission_global("ServerPort", "9000"),
            iroutes=routes,
            hostip_alts=":".join(others),
            warp=self.clock.warp,
        )

    def host(self) -> str:
        """The address to give."""
        config = self.config
        if config.default_hostip_force:
            return str(config.default_hostip_force)
        wanted = config.prefer_interface.strip().lower()
        starts = _KIND_OF_INTERFACE.get(wanted.rstrip("0123456789"), (wanted,))
        for exact in (True, False):
            for name, address in self._found:
                if wanted and (name.lower() == wanted if exact else name.lower().startswith(starts)):
                    return address
        return self._found[0][1] if self._found else str(config.default_hostip)

    def _scan(self) -> None:
        network = self.context.network
        found = network.addresses() if network is not None else []
        if found != self._found:
            self._found = found
            shown = ", ".join(f"{name} {address}" for name, address in found) or "none"
            self.event(f"addresses: {shown}")

    def _post(self, text: str) -> None:
        host = self.host()
        self.notify("PHI_HOST_INFO", text)
        self.notify("PHI_HOST_IP", host)
        self.notify("PHI_HOST_IP_ALL", ",".join(address for _, address in self._found) or host)
        self.notify("PHI_HOST_IP_VERBOSE", ",".join(f"{name.upper()}={a}" for name, a in self._found))
        self.notify("PHI_HOST_PORT_DB", self.mission_global("ServerPort", "9000"))

    def report(self) -> Iterable[str]:
        yield f"Address given: {self.host()}"
        for name, address in self._found:
            yield f"  {name}: {address}"
        yield f"Share listens at: {', '.join(self._routes) or 'nowhere yet'}"
