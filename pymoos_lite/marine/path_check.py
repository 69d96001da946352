"""uFldPathCheck: how far and how fast vessels have gone, as an app (marine_apps.md 7.4)."""

from __future__ import annotations

from collections.abc import Iterable

from pymoos_lite.app.mail_values import Handler, HandlerApp
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.marine.encounters import Fix
from pymoos_lite.marine.odometry import Odometer
from pymoos_lite.records.csp import clip
from pymoos_lite.records.node_report import NodeReport

_MAX_VESSELS = 2000


class PathCheck(HandlerApp):
    """Odometers of all vessels that report."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "history_length",
                "integer",
                10,
                "",
                "Reports over which speed is averaged.",
                low=2,
                high=100_000,
            ),
        )
    )

    def on_start_up(self) -> None:
        self.odometers: dict[str, Odometer] = {}
        self._told: dict[str, str] = {}
        self._handlers: dict[str, Handler] = {"NODE_REPORT": self._hear, "UPC_TRIP_RESET": self._reset}

    def iterate(self) -> None:
        for name, odometer in self.odometers.items():
            self.notify("UPC_SPEED_REPORT", odometer.speed_report(name))
            text = odometer.odometry_report(name)
            if self._told.get(name) != text:
                self._told[name] = text
                self.notify("UPC_ODOMETRY_REPORT", text)

    def report(self) -> Iterable[str]:
        yield f"{'Vessel':<16}{'Speed':>8}{'Trip':>10}{'Total':>10}"
        for name, odometer in sorted(self.odometers.items()):
            yield f"{clip(name, 15):<16}{odometer.mean_speed:>8.2f}{odometer.trip:>10.1f}{odometer.total:>10.1f}"

    def _hear(self, message: Message) -> None:
        try:
            report = NodeReport.parse(message.text)
        except ValueError as error:
            self.run_warning(f"NODE_REPORT refused: {clip(str(error), 80)}")
            return
        if report.x is None or report.y is None or report.time is None or not report.name:
            self.run_warning("NODE_REPORT refused: a name, a time, x and y are needed")
            return
        if report.name not in self.odometers:
            if len(self.odometers) >= _MAX_VESSELS:
                self.run_warning(f"more than {_MAX_VESSELS} vessels: the others are not followed")
                return
            self.odometers[report.name] = Odometer(self.config.history_length)
        self.odometers[report.name].hear(Fix(report.time, report.x, report.y, report.heading or 0.0))

    def _reset(self, message: Message) -> None:
        name = message.text.strip()
        odometer = self.odometers.get(name)
        if odometer is None:
            self.run_warning(f"UPC_TRIP_RESET: no vessel '{clip(name)}' has reported")
        else:
            odometer.reset_trip()
