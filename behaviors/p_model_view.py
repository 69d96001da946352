"""BHV_PModelView: draw how the vessel will turn (behaviors.md C27)."""

from __future__ import annotations

from dataclasses import replace

from behaviors import forms
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.specs import seglr_text


class PModelView(Behavior):
    """Has no opinion; draws the path of the helm's turn model onto the heading asked for."""

    BHV_NAME = "BHV_PModelView"
    DEFAULT_NAME = "bhv_pmodel_view"
    VARIABLES = ()
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "DESIRED_HEADING")
    PARAMETERS = Declaration(
        (
            forms.custom("edge_color", forms.read_color, "white", "Colour of the path.", "white"),
            forms.custom("vertex_color", forms.read_color, "white", "Colour of its points.", "white"),
            forms.number("vertex_size", 3.0, "pixels", "Size of its points."),
        )
    )

    def on_run(self) -> None:
        heading, platform = self.buffer.number("DESIRED_HEADING"), self.surroundings.platform
        if heading is None or platform is None or not self.visuals:
            return
        self.why = f"onto heading {heading:.0f}"
        config = self.config
        looks = Attributes(
            label=self._label,
            edge_color=config.edge_color,
            vertex_color=config.vertex_color,
            vertex_size=config.vertex_size,
        )
        self.post("VIEW_SEGLR", seglr_text(replace(platform.model.seglr(heading), attributes=looks)))

    @property
    def _label(self) -> str:
        return f"{self.community}_seglr"

    def on_run_to_idle(self) -> None:
        if self.visuals:
            self.post("VIEW_SEGLR", f"pts={{0,0:9,0:0,9}},ray=0,active=false,label={self._label}")

    def on_complete(self) -> None:
        self.on_run_to_idle()
