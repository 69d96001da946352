"""BHV_PeriodicSpeed: now and then go at a certain speed (behaviors.md C21)."""

from __future__ import annotations

from collections.abc import Iterable

from behaviors import forms
from behaviors.steering import speed_peak
from ivp_helm.behavior import Behavior
from ivp_helm.flags import parse_flag
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter


class PeriodicSpeed(Behavior):
    """Alternates between a lazy time without any opinion and a busy time that asks for a speed."""

    BHV_NAME = "BHV_PeriodicSpeed"
    DEFAULT_NAME = "bhv_periodic_speed"
    VARIABLES = ("speed",)
    PARAMETERS = Declaration(
        (
            forms.number("period_lazy", 0.0, "s", "Time without opinion; required."),
            forms.number("period_busy", 0.0, "s", "Time with one; required."),
            forms.number("period_speed", 0.0, "m/s", "Speed of the busy time."),
            forms.number(
                "basewidth",
                0.0,
                "m/s",
                "Width of each flank.",
                clip=True,
                aliases=("zaic_basewidth", "period_basewidth"),
            ),
            forms.number(
                "peakwidth",
                0.0,
                "m/s",
                "Half width of the summit.",
                clip=True,
                aliases=("zaic_peakwidth", "period_peakwidth"),
            ),
            Parameter(
                "summit_delta",
                "number",
                25.0,
                "",
                "Fall over the summit.",
                low=0.0,
                high=100.0,
                clip=True,
                aliases=("summitdelta", "zaic_summit_delta", "period_summit_delta"),
            ),
            Parameter("initially_busy", "boolean", False, "", "Begin with a busy time."),
            Parameter("reset_upon_running", "boolean", True, "", "Begin anew on starting to run."),
        )
    )

    def setup(self) -> None:
        self.config.activeflag.append(parse_flag("PERIODIC_SPEED=1"))
        self.config.inactiveflag.append(parse_flag("PERIODIC_SPEED=0"))
        self._busy = False
        self._since: float | None = None
        """When the present time, lazy or busy, began."""
        self._count = 0

    def check(self) -> Iterable[str]:
        for name in ("period_lazy", "period_busy"):
            if not getattr(self.config, name) > 0.0:
                yield f"{name} must be above 0 seconds"

    def on_parameters(self) -> None:
        if self._since is None:
            self._busy = self.config.initially_busy

    def on_every_state(self) -> None:
        self.post("PS_BUSY_COUNT", float(self._count))

    def on_idle_to_run(self) -> None:
        if self.config.reset_upon_running or self._since is None:
            self._since = self.now
            self._busy = self.config.initially_busy

    def on_idle(self) -> None:
        self._tell()

    def on_run(self) -> IvPFunction | None:
        config = self.config
        assert self._since is not None
        length = config.period_busy if self._busy else config.period_lazy
        if self.now - self._since >= length - 1e-9:
            self._since = self.now
            self._busy = not self._busy
            self._count += self._busy
        self._tell()
        if not self._busy:
            self.why = f"lazy for {self._left():.0f} s more"
            return None
        self.why = f"busy for {self._left():.0f} s more"
        return speed_peak(
            self.domain, config.period_speed, config.peakwidth, config.basewidth, config.summit_delta
        )

    def _left(self) -> float:
        length = float(self.config.period_busy if self._busy else self.config.period_lazy)
        return max(0.0, length - (self.now - self._since)) if self._since is not None else length

    def _tell(self) -> None:
        left = self._left()
        self._post_rounded("PS_PENDING_INACTIVE", left if self._busy else 0.0)
        self._post_rounded("PS_PENDING_ACTIVE", 0.0 if self._busy else left)

    def _post_rounded(self, variable: str, seconds: float) -> None:
        if seconds > 1.0:
            self.post_int(variable, seconds)
        else:
            self.post(variable, seconds)
