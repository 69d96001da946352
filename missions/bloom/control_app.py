"""pBloomStormCtrl: the mission control of one vessel as an app (gcid.md 12)."""

from __future__ import annotations

from collections.abc import Iterable

from mypy_extensions import mypyc_attr

from missions.bloom.allocation import METHODS
from missions.bloom.coalitions import SET_PARAMETERS, given_sets, names_in
from missions.bloom.control import Control, ControlSettings, standby_offset
from missions.bloom.inputs import InputSettings
from missions.bloom.zones import XRAY, YANKEE
from pymoos_lite.app import App
from pymoos_lite.app.mail_values import dispatch, finite_number, on_number, on_text, on_truth
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.records.node_message import NodeMessage
from pymoos_lite.records.node_report import NodeReport


def parse_place(text: str) -> tuple[int, int]:
    number, slash, count = text.partition("/")
    if not slash or not number.strip().isdigit() or not count.strip().isdigit():
        raise ValueError("expected NUMBER/COUNT, e.g. 1/8")
    index, total = int(number), int(count)
    if not 1 <= index <= total:
        raise ValueError(f"there is no place {index} of {total}")
    return index - 1, total


def _polygon(name: str, default: str, doc: str) -> Parameter:
    return Parameter(
        name, "custom", parse_polygon(default), "", doc, parse=parse_polygon, example=f"pts={{{default}}}"
    )


def _number(
    name: str, default: float, unit: str, doc: str, *aliases: str, low: float | None = None
) -> Parameter:
    return Parameter(name, "number", default, unit, doc, low=low, aliases=aliases)


@mypyc_attr(allow_interpreted_subclasses=True)
class BloomControl(App):
    """Posts the inputs of the three options, and does the book-keeping of sample points and migrations."""

    MOOS_NAME = "pBloomStormCtrl"
    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            _polygon("region_1_spec", XRAY, "The first zone, where the mission begins; convex."),
            _polygon("region_2_spec", YANKEE, "The other zone; convex."),
            _number("sample_radius", 15.0, "m", "Distance of the outer sample points from a discovery.", low=0.0),
            _number("sample_time", 30.0, "s", "An announced sampling is forgotten after so long.", low=0.0),
            _number("sample_capture_radius", 5.0, "m", "A vessel this near to a point samples it.", low=0.0),
            _number("max_batt", 15.5, "V", "Voltage of a full battery."),
            _number("min_batt", 11.5, "V", "Voltage of an empty one."),
            _number("batt_input_gain", 50.0, "", "Explore input of an empty battery.", "batt_exh_gain"),
            _number("cutoff_freq_batt", 0.1, "Hz", "Of the battery's low-pass filter.", low=0.0),
            _number("no_sample_available_weight", 50.0, "", "Explore input when there is nothing to sample."),
            _number("currently_sampling_weight", 50.0, "", "Exploit input while sampling."),
            _number("dist_to_next_sample_max_input_value", 50.0, "", "Exploit input for a far sample point."),
            _number("dist_to_next_sample_max_input_range", 0.0, "m", "Up to here a sample point gives no input."),
            _number("dist_to_next_sample_min_input_range", 150.0, "m", "From here on it gives all of it."),
            _number("storm_detected_input_val", 100.0, "", "Migrate input in a storm."),
            _number("finish_migration_input_val", 60.0, "", "Migrate input while somebody is not there yet."),
            _number("time_since_last_migration_thresh", 300.0, "s", "Least time between migrations.", low=0.0),
            _number("time_since_last_migration_resistance_val", -100.0, "", "Migrate input right after one."),
            _number("time_since_no_samples_thresh", 60.0, "s", "Patience without sample points.", low=0.0),
            _number("time_since_no_samples_encouragement_slope", 0.1, "1/s", "Migrate input for each second more."),
            Parameter("allocation", "choice", "greedy", "", "Who goes to which sample point: the paper's greedy rule, "
                      "or the least sum of all ways.", choices=tuple(METHODS)),
            *SET_PARAMETERS,
            _number("standby_radius", 0.0, "m", "Vessels without a sample point wait this far from the zone's middle, "
                    "each at a place of its own.", low=0.0),
            Parameter("standby_place", "custom", (0, 1), "", "Number of the own place, and how many there are.",
                      parse=parse_place, example="1/8"),
        )
    )  # fmt: skip

    def on_start_up(self) -> None:
        self.control = Control(self.community, self._settings(), self.now)
        control = self.control
        self._handlers = {
            "NODE_REPORT": on_text(self, self._hear_report),
            "OPTION": on_text(self, lambda text: control.hear_option(text, self.now)),
            "CONTACTS_LIST": on_text(self, lambda text: control.hear_contacts(names_in(text))),
            "EXPLORE_LIST": on_text(self, lambda text: control.hear_coalition("explore", names_in(text))),
            "EXPLOIT_LIST": on_text(self, lambda text: control.hear_coalition("exploit", names_in(text))),
            "BLOOM_DETECTED": on_truth(self, control.hear_bloom),
            "STORM_DETECTED": on_truth(self, lambda storm: setattr(control, "storm", storm)),
            "SAMPLE_LOC": on_text(self, control.hear_sample_point),
            "SAMPLE_STARTING": on_text(self, lambda text: control.hear_start(text, self.now)),
            "SAMPLE_FINISHING": on_text(self, control.hear_finish),
            "MIGRATION_DONE": on_truth(self, lambda done: control.hear_migration_done(done, self.now)),
            "M300_BATT_VOLTAGE": on_number(self, lambda volts: setattr(control.battery, "volts", volts)),
        }

    def _settings(self) -> ControlSettings:
        c = self.config
        if c.max_batt <= c.min_batt:
            raise ValueError(
                f"{self.name}: max_batt {c.max_batt:g} must be more than min_batt {c.min_batt:g}"
            )
        near, far = c.dist_to_next_sample_max_input_range, c.dist_to_next_sample_min_input_range
        if far <= near:
            raise ValueError(
                f"{self.name}: dist_to_next_sample_min_input_range {far:g} must be more than "
                f"dist_to_next_sample_max_input_range {near:g}"
            )
        inputs = InputSettings(
            max_batt=c.max_batt,
            min_batt=c.min_batt,
            batt_input_gain=c.batt_input_gain,
            battery_lag=1.0 / c.cutoff_freq_batt if c.cutoff_freq_batt > 0.0 else 0.0,
            no_sample_available_weight=c.no_sample_available_weight,
            currently_sampling_weight=c.currently_sampling_weight,
            sample_input=c.dist_to_next_sample_max_input_value,
            sample_near=near,
            sample_far=far,
            storm_detected_input=c.storm_detected_input_val,
            finish_migration_input=c.finish_migration_input_val,
            migration_pause=c.time_since_last_migration_thresh,
            migration_resistance=c.time_since_last_migration_resistance_val,
            no_samples_patience=c.time_since_no_samples_thresh,
            no_samples_slope=c.time_since_no_samples_encouragement_slope,
        )
        exploit, explore = given_sets(c)
        index, count = c.standby_place
        return ControlSettings(
            zones=(c.region_1_spec, c.region_2_spec),
            inputs=inputs,
            sample_radius=c.sample_radius,
            sample_time=c.sample_time,
            sample_capture_radius=c.sample_capture_radius,
            allocation=c.allocation,
            exploit_set=exploit,
            explore_set=explore,
            standby=standby_offset(index, count, c.standby_radius),
        )

    def on_connect(self) -> None:
        for name in (*self._handlers, "NAV_X", "NAV_Y"):
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        x = y = None
        others = []
        for message in mail:
            if message.name == "NAV_X":
                x = finite_number(message)
            elif message.name == "NAV_Y":
                y = finite_number(message)
            else:
                others.append(message)
        if x is not None or y is not None:
            self.control.hear_position(x, y)
        dispatch(self, self._handlers, others)

    def _hear_report(self, text: str) -> None:
        report = NodeReport.parse(text)
        if report.name and report.x is not None and report.y is not None:
            self.control.hear_report(report.name, report.x, report.y, self.now)

    def iterate(self) -> None:
        for post in self.control.step(self.now):
            self.notify(post.variable, post.value)
            if post.to_all and not isinstance(post.value, bytes):
                message = NodeMessage(
                    self.community, post.variable, post.value, dest_node="all", src_app=self.name
                )
                self.notify("NODE_MESSAGE_LOCAL", message.to_text())

    def report(self) -> Iterable[str]:
        control, totals = self.control, self.control.totals
        explore, exploit, migrate = control.inputs
        yield f"Option:    {control.option or '(none yet)'}   changes {totals.option_changes}"
        yield f"Inputs:    explore {explore:.1f}   exploit {exploit:.1f}   migrate {migrate:.1f}"
        yield f"Zone:      {control.zone + 1}   migrations {totals.migrations}   done {control.migration_done}"
        yield f"Sensors:   bloom {control.bloom}   storm {control.storm}"
        yield f"Battery:   {100.0 * (control.battery.exhaustion or 0.0):.1f} % exhausted"
        yield f"Way made:  {control.odometer:.0f} m   samples {totals.samples}   discoveries {totals.discoveries}"
        yield f"Exploring: {', '.join(sorted(control.explorers)) or '-'}"
        yield f"Sampling:  {', '.join(sorted(control.samplers)) or '-'}"
        yield f"Target:    {control.target or '-'}   of {len(control.points)} sample points"
        for label, (x, y) in control.points.items():
            yield f"  {label:<16} {x:>8.1f} {y:>8.1f}"
