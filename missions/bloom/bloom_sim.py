"""uFldBloomStormSim: blooms and storms at the shoreside, and who notices them (gcid.md 16)."""

from __future__ import annotations

from collections.abc import Iterable

from missions.bloom.environment import (
    STORM_LABEL,
    Bloom,
    Environment,
    EnvironmentSettings,
    Storm,
    StormTrack,
    exploring_share,
)
from missions.bloom.zones import STORM_REGION, XRAY, YANKEE
from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Circle, Point
from pymoos_lite.geometry.specs import parse_polygon, point_text
from pymoos_lite.geometry.text import fields
from pymoos_lite.records.csp import RecordError, clip
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import circle_text

DRAWN_STEP = 0.5
"""Metres by which a circle must have changed to be drawn again."""


def parse_track(text: str) -> StormTrack:
    """``time=2300,x=-115,y=-300,course=154``.

    Raises:
        ValueError: it has another form.
    """
    pairs = {key.lower(): value for key, value in fields(text)}
    if set(pairs) != {"time", "x", "y", "course"}:
        raise ValueError("expected time=S,x=M,y=M,course=DEGREES")
    return StormTrack(**{key: parse_number(value) for key, value in pairs.items()})


def _change(a: tuple[float, float, float, str], b: tuple[float, float, float, str]) -> float:
    return max(abs(a[0] - b[0]), abs(a[1] - b[1]), abs(a[2] - b[2]))


def _names(text: str) -> frozenset[str]:
    return frozenset(part.strip().lower() for part in text.split(",") if part.strip())


def _number(name: str, default: float, unit: str, doc: str, low: float | None = 0.0) -> Parameter:
    return Parameter(name, "number", default, unit, doc, low=low)


def _polygon(name: str, default: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", parse_polygon(default), "", doc, parse=parse_polygon, example=f"pts={{{default}}}"
    )


class BloomStormSim(App):
    """Tells every vessel whether it is in a bloom or in a storm, and keeps count of the blooms."""

    MOOS_NAME = "uFldBloomStormSim"
    DEFAULT_TICK = 1.0
    PARAMETERS = Declaration(
        (
            _polygon("region1", XRAY, "The first zone; convex."),
            _polygon("region2", YANKEE, "The second zone; convex."),
            _number("bloom_rad_min", 100.0, "m", "Least full radius of a bloom."),
            _number("bloom_rad_max", 200.0, "m", "Greatest full radius."),
            _number("bloom_duration_min", 300.0, "s", "Shortest life of a bloom."),
            _number("bloom_duration_max", 360.0, "s", "Longest life."),
            _number("bloom_max_speed", 0.0, "m/s", "Fastest drift along each axis."),
            Parameter("growth", "choice", "linear", "", "linear: the radius grows over the whole life; fixed: it is "
                      "full from the start.", choices=("linear", "fixed")),
            Parameter("probability_of_new_bloom", "number", 0.1, "", "Chance per second of a new bloom, once the wait "
                      "is over.", low=0.0, high=1.0),
            _number("time_between_bloom_attempts", 90.0, "s", "Wait after a bloom began."),
            Parameter("only_post_in_region_one", "boolean", False, "", "No blooms in the second zone."),
            Parameter("allow_storms", "boolean", True, "", "Whether there are storms."),
            _number("storm_radius", 100.0, "m", "Radius of a storm."),
            _number("storm_speed", 1.0, "m/s", "Speed of a storm."),
            _number("storm_max_angle", 20.0, "deg", "Greatest deviation from the headings 334 and 154."),
            _number("time_between_storms", 1000.0, "s", "Wait after a storm."),
            _polygon("storm_region", STORM_REGION, "Where storms live; convex."),
            Parameter("storm_track", "custom", None, "", "A storm at a given time instead of drawn ones: when it "
                      "enters the storm region, a point its centre passes, its course.", parse=parse_track,
                      repeated=True, example="time=2300,x=-115,y=-300,course=154"),
            Parameter("storm_sensors", "custom", None, "", "The vessels that can sense storms; default all.",
                      parse=_names, example="abe"),
            Parameter("sensor_decay_parameter", "number", 1.0, "1/m", "How fast the sensor's reading falls with "
                      "distance.", low=0.0, open_low=True),
            Parameter("seed", "integer", None, "", "Seed of blooms and storms; default the mission's seed.", low=0),
        )
    )  # fmt: skip

    def on_start_up(self) -> None:
        c = self.config
        settings = EnvironmentSettings(
            zones=(c.region1, c.region2),
            storm_region=c.storm_region,
            bloom_radius=(c.bloom_rad_min, c.bloom_rad_max),
            bloom_duration=(c.bloom_duration_min, c.bloom_duration_max),
            bloom_growth=c.growth,
            bloom_max_speed=c.bloom_max_speed,
            bloom_chance=c.probability_of_new_bloom,
            time_between_blooms=c.time_between_bloom_attempts,
            first_zone_only=c.only_post_in_region_one,
            allow_storms=c.allow_storms,
            storm_radius=c.storm_radius,
            storm_speed=c.storm_speed,
            storm_max_angle=c.storm_max_angle,
            time_between_storms=c.time_between_storms,
            storm_tracks=tuple(c.storm_track),
        )
        seed: int | None = c.seed if c.seed is not None else self.context.seed
        self.environment = Environment(settings, self.random.getrandbits(32) if seed is None else seed)
        self._places: dict[str, tuple[float, float]] = {}
        self._options: dict[str, str] = {}
        self._drawn: dict[str, tuple[float, float, float, str]] = {}
        self._deployed_at: float | None = None
        self._share_sum = 0.0
        self._share_time = 0.0
        self._said: dict[str, str] = {}
        self._last = self.now

    def on_connect(self) -> None:
        for name in ("NODE_REPORT", "SAMPLE_FINISHED_LOG", "DEPLOY_ALL", "OPTION_*"):
            self.register(name)
        self._said.clear()
        self._tell_tally()

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == "NODE_REPORT":
                self._hear_report(message.text)
            elif message.name == "SAMPLE_FINISHED_LOG":
                self._sample(message.text)
            elif message.name == "DEPLOY_ALL":
                if message.text.lower() == "true" and self._deployed_at is None:
                    self._deployed_at = self.now
            elif message.name.startswith("OPTION_"):
                self._options[message.name.removeprefix("OPTION_").lower()] = message.text

    def _hear_report(self, text: str) -> None:
        try:
            report = NodeReport.parse(text)
        except RecordError as error:
            self.run_warning(str(error))
            return
        if report.name and report.x is not None and report.y is not None:
            self._places[report.name.lower()] = (report.x, report.y)

    def _sample(self, name: str) -> None:
        place = self._places.get(name.lower())
        if place is None:
            self.run_warning(f"SAMPLE_FINISHED_LOG names '{clip(name, 40)}', which has not reported")
            return
        bloom = self.environment.sample(*place)
        self.event(f"{name} sampled " + (bloom.label if bloom is not None else "no bloom"))

    # --- work --------------------------------------------------------------------------------

    def iterate(self) -> None:
        environment, decay = self.environment, self.config.sensor_decay_parameter
        environment.advance(self.now - self.started)
        sensors = self.config.storm_sensors
        for name, (x, y) in self._places.items():
            upper = name.upper()
            self.notify(f"BLOOM_DETECTED_{upper}", environment.detect(x, y))
            storm = (sensors is None or name in sensors) and environment.in_storm(x, y)
            self.notify(f"STORM_DETECTED_{upper}", storm)
            self.notify(f"SENSOR_MEAS_{upper}", environment.measure(x, y, decay))
        self._draw()
        self._tell_tally()
        self._evaluate()
        self._last = self.now

    def _tell_tally(self) -> None:
        tally = self.environment.tally
        for name, count in (
            ("SAMPLED_BLOOMS_COMPLETED", tally.sampled),
            ("DETECTED_BLOOMS_COMPLETED", tally.detected),
            ("UNSAMP_UNDETECT_BLOOMS_COMPLETED", tally.missed),
        ):
            text = str(count)
            if self._said.get(name) != text:
                self._said[name] = text
                self.notify(name, text)

    def _evaluate(self) -> None:
        """The share of explorers, now and over time, from the deployment on."""
        known = [option for name, option in self._options.items() if name in self._places]
        share = exploring_share(known)
        if self._deployed_at is None or share is None:
            return
        span = self.now - self._last
        self._share_sum += share * span
        self._share_time += span
        self.notify("MIXED_STRAT", share)
        if self._share_time > 0.0:
            self.notify("MIXED_STRAT_RNG_AVG", self._share_sum / self._share_time)

    # --- pictures ----------------------------------------------------------------------------

    def _draw(self) -> None:
        for bloom in self.environment.expired:
            self._erase(bloom.label)
        for bloom in self.environment.blooms:
            self._circle(
                bloom.label, bloom, "limegreen" if bloom.sampled else "pink" if bloom.detected else "red"
            )
        storm = self.environment.storm
        if storm is not None:
            self._circle(STORM_LABEL, storm, "dodger_blue")
        elif STORM_LABEL in self._drawn:
            self._erase(STORM_LABEL)

    def _circle(self, label: str, what: Bloom | Storm, color: str) -> None:
        new = (what.x, what.y, what.radius, color)
        old = self._drawn.get(label)
        if old is not None and old[3] == color and _change(new, old) < DRAWN_STEP:
            return
        self._drawn[label] = new
        looks = Attributes(label=label, edge_color=color, fill_color=color, fill_transparency=0.3)
        self.notify("VIEW_CIRCLE", circle_text(Circle(what.x, what.y, what.radius, looks)))

    def _erase(self, label: str) -> None:
        if self._drawn.pop(label, None) is not None:
            text = point_text(Point(attributes=Attributes(label=label, active=False)))
            self.notify("VIEW_CIRCLE", f"{text},radius=0")

    def report(self) -> Iterable[str]:
        environment, tally = self.environment, self.environment.tally
        yield f"Over: {tally.sampled} sampled, {tally.detected} detected only, {tally.missed} missed"
        yield "Bloom         x       y   radius   age"
        for bloom in environment.blooms:
            state = "sampled" if bloom.sampled else "detected" if bloom.detected else ""
            age = environment.now - bloom.start
            yield f"  {bloom.label:<10} {bloom.x:>7.1f} {bloom.y:>7.1f} {bloom.radius:>6.1f} {age:>6.0f} {state}"
        storm = environment.storm
        yield (
            "Storm: none"
            if storm is None
            else f"Storm: {storm.x:.1f},{storm.y:.1f} course {storm.course:.0f}"
        )
