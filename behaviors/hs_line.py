"""BHV_HSLine: draw where the vessel is asked to go (behaviors.md C27)."""

from __future__ import annotations

from behaviors import forms
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration
from pymoos_lite.geometry.angles import project_point
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import SegList
from pymoos_lite.geometry.specs import erase_seglist_text, seglist_text


class HSLine(Behavior):
    """Has no opinion; draws a line from own ship along the heading asked for, the longer the faster.

    At the highest speed ever asked for it reaches as far as `time_on_leg` seconds do.
    """

    BHV_NAME = "BHV_HSLine"
    DEFAULT_NAME = "bhv_hsline"
    VARIABLES = ()
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "DESIRED_HEADING", "DESIRED_SPEED")
    PARAMETERS = Declaration((forms.number("time_on_leg", 60.0, "s", "What the line stands for."),))

    def setup(self) -> None:
        self._label = f"{self.community}_hsline"
        self._highest = 0.0

    def on_run(self) -> None:
        own = self.own
        heading = self.buffer.number("DESIRED_HEADING")
        speed = self.buffer.number("DESIRED_SPEED")
        if heading is None or speed is None:
            self.why = "nothing was decided yet"
            return
        self._highest = max(self._highest, speed)
        share = speed / self._highest if self._highest > 0.0 else 0.0
        length = max(0.0, speed * self.config.time_on_leg * share)
        self.why = f"{length:.0f} m along heading {heading:.0f}"
        if self.visuals:
            looks = Attributes(
                label=self._label, label_color="invisible", edge_color="white", vertex_size=0.0
            )
            line = SegList(((own.x, own.y), project_point(heading, length, own.x, own.y)), attributes=looks)
            self.post("VIEW_SEGLIST", seglist_text(line))

    def on_run_to_idle(self) -> None:
        if self.visuals:
            self.post("VIEW_SEGLIST", erase_seglist_text(self._label))

    def on_complete(self) -> None:
        self.on_run_to_idle()
