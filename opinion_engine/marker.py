"""uOptionMarker: a circle around each vessel, in the colour of the option its opinions favour (gcid.md 17).

`option_circle` is the whole rule; the app collects positions and opinions, of its own vessel and of any other
it hears of, so it serves on a vessel and at the shore.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from mypy_extensions import mypyc_attr

from opinion_engine.messages import MessageError, parse_text
from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.colors import color_rgb
from pymoos_lite.geometry.shapes import Circle
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import circle_text

STALE = 3.0
"""Seconds after which an opinion is no longer shown."""

MAX_VESSELS = 500
_GRAY = (0.5, 0.5, 0.5)


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class Looks:
    """How circles look: colours by option, radius in metres, line width in pixels, and the opinion at which
    the
    colour is full; below it fades to gray."""

    colors: Mapping[str, str]
    radius: float = 5.0
    edge_size: float = 1.0
    saturated: float = 1.0


@mypyc_attr(native_class=False)
@dataclass(slots=True)
class Seen:
    """What is known of one vessel: position in metres, and its opinions with their time."""

    x: float | None = None
    y: float | None = None
    opinions: Mapping[str, float] | None = None
    time: float = 0.0


def option_circle(vessel: str, seen: Seen, looks: Looks) -> Circle | None:
    """The circle of a vessel, None while its position or opinions are unknown or no option leads."""
    if seen.x is None or seen.y is None or not seen.opinions:
        return None
    option = max(seen.opinions, key=lambda name: seen.opinions[name])  # type: ignore[index]
    value = seen.opinions[option]
    if value <= 0.0:
        return None
    share = min(1.0, value / looks.saturated)
    full = color_rgb(looks.colors.get(option, "white")) or (1.0, 1.0, 1.0)
    mixed = [share * c + (1.0 - share) * g for c, g in zip(full, _GRAY, strict=True)]
    color = ":".join(f"{c:.3f}".rstrip("0").rstrip(".") for c in mixed)
    attributes = Attributes(label=f"{vessel}'s opt_circ", edge_color=color, edge_size=looks.edge_size)
    return Circle(seen.x, seen.y, looks.radius, attributes)


def _color_pair(text: str) -> tuple[str, str]:
    option, colon, color = (part.strip() for part in text.partition(":"))
    if not colon or not option or color_rgb(color) is None:
        raise ValueError("expected option:color with a colour name")
    return option.lower(), color


@mypyc_attr(allow_interpreted_subclasses=True)
class OptionMarker(App):
    """Draws each vessel's favoured option as a coloured circle."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "color_set",
                "custom",
                None,
                "",
                "Colour of an option's circle.",
                repeated=True,
                parse=_color_pair,
                example="explore:green",
            ),
            Parameter("radius", "number", 5.0, "m", "Radius of the circles.", low=0.0, open_low=True),
            Parameter("edge_size", "number", 1.0, "pixels", "Width of the line.", low=0.0),
            Parameter(
                "opinion_saturated_limit",
                "number",
                1.0,
                "",
                "Opinion at which the colour is full; below it the colour fades to gray.",
                low=0.0,
                open_low=True,
            ),
            Parameter(
                "post_circ_with_stale_opinion", "boolean", False, "", "Keep circles of opinions over 3 s old."
            ),
        )
    )
    DEFAULT_TICK = 2.0

    def on_start_up(self) -> None:
        config = self.config
        self.looks = Looks(
            dict(config.color_set), config.radius, config.edge_size, config.opinion_saturated_limit
        )
        self.vessels: dict[str, Seen] = {}
        self._drawn: dict[str, str] = {}

    def on_connect(self) -> None:
        for name in (
            "OWN_OPINION_STATE",
            "OPINION_MESSAGE",
            "NODE_REPORT",
            "NODE_REPORT_LOCAL",
            "NAV_X",
            "NAV_Y",
        ):
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            name, value = message.name, message.value
            if name in ("NAV_X", "NAV_Y"):
                number = message.number
                if number is not None:
                    own = self._seen(self.community)
                    if name == "NAV_X":
                        own.x = number
                    else:
                        own.y = number
            elif not isinstance(value, str):
                continue  # binary opinions have no names of their own
            elif name.startswith("NODE_REPORT"):
                try:
                    report = NodeReport.parse(value)
                except RecordError as error:
                    self.run_warning(str(error))
                    continue
                if report.x is not None and report.y is not None:
                    vessel = self._seen(report.name)
                    vessel.x, vessel.y = report.x, report.y
            else:
                try:
                    said = parse_text(value)
                except MessageError as fault:
                    self.run_warning(str(fault))
                    continue
                speaker = self._seen(said.vname)
                speaker.opinions, speaker.time = said.opinions, message.time

    def _seen(self, vessel: str) -> Seen:
        """What is known of a vessel; of one too many nothing is kept."""
        key = vessel.lower()
        seen = self.vessels.get(key)
        if seen is None:
            seen = Seen()
            if key and len(self.vessels) < MAX_VESSELS:
                self.vessels[key] = seen
        return seen

    def iterate(self) -> None:
        for vessel, seen in self.vessels.items():
            fresh = self.config.post_circ_with_stale_opinion or self.now - seen.time <= STALE
            circle = option_circle(vessel, seen, self.looks) if fresh else None
            if circle is not None:
                text = circle_text(circle)
            elif vessel in self._drawn:
                text = circle_text(Circle(attributes=Attributes(label=f"{vessel}'s opt_circ", active=False)))
            else:
                continue
            if self._drawn.get(vessel) != text:
                self._drawn[vessel] = text
                self.notify("VIEW_CIRCLE", text)

    def report(self) -> Iterable[str]:
        yield f"{'Vessel':<16} {'Option':<16} {'Opinion':>9} {'Age':>7}"
        for vessel, seen in sorted(self.vessels.items()):
            opinions = seen.opinions or {}
            option = max(opinions, key=lambda name: opinions[name], default="-")
            shown = f"{opinions[option]:9.3f}" if opinions else f"{'-':>9}"
            yield f"{vessel:<16} {option:<16} {shown} {self.now - seen.time:6.1f}s"
