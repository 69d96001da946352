"""pContactMgrV20: the contact manager as an app (marine_apps.md 5)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from mypy_extensions import mypyc_attr

from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.app.mail_values import Handler, HandlerApp, on_level, on_text, on_truth
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Circle
from pymoos_lite.marine.able_orders import AbleOrders
from pymoos_lite.marine.contact_alerts import apply_request, flag_post
from pymoos_lite.marine.contact_filter import FILTER_KEYS, ContactFilter
from pymoos_lite.marine.contact_manager_core import ContactManagerCore, ContactManagerParameters
from pymoos_lite.records.contact_ledger import parse_decay
from pymoos_lite.records.csp import clip, parse_flag, parse_number
from pymoos_lite.records.view import circle_text

_RADII_DURATION = 3.0  # s that the alert range stays drawn


def _alert(text: str) -> str:
    apply_request(text, {})
    return text


def _off_or_metres(text: str) -> float | None:
    return _off_or(text, "metres")


def _off_or_seconds(text: str) -> float | None:
    return _off_or(text, "seconds")


def _off_or(text: str, unit: str) -> float | None:
    if text.strip().lower() == "off":
        return None
    number = parse_number(text)
    if number is None or number <= 0.0:
        raise ValueError(f"expected {unit} above 0, or off")
    return number


def _flag(text: str) -> str:
    parse_flag(text)
    return text


def _filter_entry(key: str) -> Callable[[str], tuple[str, str]]:
    def parse(text: str) -> tuple[str, str]:
        ContactFilter().with_entry(key, text)
        return key, text

    return parse


def _filter(key: str, doc: str, example: str) -> Parameter:
    return Parameter(key, "custom", None, "", doc, parse=_filter_entry(key), repeated=True, example=example)


def _flags(name: str, doc: str) -> Parameter:
    return Parameter(name, "custom", None, "", doc, parse=_flag, repeated=True, example="SEEN=$[VNAME]")


def _switch(name: str, doc: str) -> Parameter:
    return Parameter(name, "boolean", False, "", doc)


def _number(name: str, default: float, unit: str, doc: str, **more: Any) -> Parameter:
    return Parameter(name, "number", default, unit, doc, **more)


CONTACT_MANAGER_DECLARATION = Declaration(
    (
        Parameter(
            "alert",
            "custom",
            None,
            "",
            "An alert, as in BCM_ALERT_REQUEST; lines of one id add up.",
            parse=_alert,
            repeated=True,
            example="id=near, on_flag=NEAR=$[VNAME], alert_range=50, cpa_range=80",
        ),
        *(
            _filter(f"{sense}_{kind}", f"Contacts to {sense}, by {kind}.", "abe, ben")
            for sense in ("ignore", "match")
            for kind in ("name", "group", "type")
        ),
        _filter("ignore_region", "Contacts to ignore, by a convex polygon.", "pts={0,0:9,0:9,9}"),
        _filter("match_region", "Contacts to match, by a convex polygon.", "pts={0,0:9,0:9,9}"),
        Parameter(
            "strict_ignore", "boolean", True, "", "Ignore contacts without the group or type asked about."
        ),
        _number("contact_max_age", 60.0, "s", "Age at which a contact retires.", low=0.0, open_low=True),
        Parameter(
            "max_retired_history",
            "integer",
            5,
            "",
            "Names of retired contacts that are kept.",
            low=1,
            high=50,
            clip=True,
        ),
        Parameter("max_contacts", "integer", 500, "", "Contacts followed at most.", low=1, high=100_000),
        Parameter(
            "reject_range",
            "custom",
            2000.0,
            "m",
            "Contacts beyond it are not followed; off for no limit.",
            parse=_off_or_metres,
        ),
        Parameter(
            "decay",
            "custom",
            (15.0, 30.0),
            "s",
            "Extrapolation slows down from the first age and rests from the second.",
            parse=parse_decay,
            example="15,30",
        ),
        Parameter(
            "recap_interval",
            "custom",
            1.0,
            "s",
            "Time between two CONTACTS_RECAP; off for none.",
            parse=_off_or_seconds,
            aliases=("contacts_recap_interval",),
        ),
        _number("range_report_timeout", 10.0, "s", "Age at which a range request may be dropped.", low=0.0),
        Parameter("range_report_maxsize", "integer", 20, "", "Range requests at most.", low=1, high=10_000),
        _switch("display_radii", "Draw the widest alert range."),
        Parameter(
            "alert_range_color",
            "text",
            "gray65",
            "",
            "Colour of the drawn alert range.",
            aliases=("default_alert_range_color",),
        ),
        _switch("post_closest_range", "Post CONTACT_CLOSEST_RANGE."),
        _switch("post_closest_relbng", "Post CONTACT_CLOSEST_RELBNG."),
        _switch("post_all_ranges", "Post CONTACT_RANGES."),
        _switch("alert_verbose", "Post ALERT_VERBOSE."),
        _switch("hold_alerts_for_helm", "No alerts before the helm drives."),
        Parameter("disable_var", "variable", "", "", "Variable that disables contact behaviours."),
        Parameter("enable_var", "variable", "", "", "Variable that enables contact behaviours."),
        Parameter("expunge_var", "variable", "", "", "Variable that removes contact behaviours."),
        _flags("able_flag", "Posted on disabling and enabling."),
        _flags("disable_flag", "Posted on disabling."),
        _flags("enable_flag", "Posted on enabling."),
        _flags("retire_flag", "Posted when a contact retires."),
        _flags("early_warning_flag", "Posted early_warning_time before an alert."),
        _flags("cease_warning_flag", "Posted when the range opens again."),
        _number("early_warning_time", -1.0, "s", "How long before an alert to warn; negative for never."),
        _switch(
            "early_warning_radii", "Accepted; the warning range depends on the contact and is not drawn."
        ),
        Parameter("ewarn_radii_color", "text", "green", "", "Accepted without effect."),
    ),
    ignored=("contact_local_coords", "display_radii_id", "cpa_range_color", "ownship_group", "ownship_type"),
)
"""Parameters of marine_apps.md 5.1."""


@mypyc_attr(allow_interpreted_subclasses=True)
class ContactManager(HandlerApp):
    """Follows contacts from NODE_REPORT, raises alerts, posts summaries."""

    PARAMETERS = CONTACT_MANAGER_DECLARATION

    def on_start_up(self) -> None:
        values = self.config
        self.core = ContactManagerCore(self.community, mission_geodesy(self), self._parameters())
        for text in values.alert:
            self.core.request_alert(text)
        self._display_radii: bool = values.display_radii
        self._orders = AbleOrders(self, "contact", self._ordered, values.max_contacts)
        self._handlers = self._mail_handlers()

    def iterate(self) -> None:
        for variable, value in self.core.step(self.now):
            self.notify(variable, value)
        if self._display_radii:
            self._draw_radii()

    def report(self) -> Iterable[str]:
        core = self.core
        yield f"Contacts: {len(core.tracked)}   retired: {', '.join(core.retired) or '-'}"
        yield "Alerts:"
        for alert_id, alert in sorted(core.alerts.items()):
            state = "" if alert.enabled else "  (disabled)"
            yield f"  {clip(alert_id, 30)}: range {alert.alert_range}, cpa range {alert.cpa_range}{state}"
        yield f"{'Name':<16}{'Range':>10}{'Extrap':>10}{'Age':>8}  Alerts"
        for contact in core.ledger:
            tracked = core.tracked.get(contact.name)
            if tracked is not None:
                yield (
                    f"{clip(contact.name, 15):<16}{tracked.range_actual:>10.1f}{tracked.range_extrapolated:>10.1f}"
                    f"{contact.age(self.now):>8.1f}  {','.join(sorted(tracked.alerts))}"
                )

    # --- start-up ----------------------------------------------------------------------------

    def _parameters(self) -> ContactManagerParameters:
        values = self.config
        told = ContactFilter(strict=values.strict_ignore)
        for key in sorted(FILTER_KEYS - {"strict_ignore"}):
            for _, text in getattr(values, key):
                try:
                    told = told.with_entry(key, text)
                except ValueError as error:
                    self.config_warning(f"{key} = {text}: {error}")
        return ContactManagerParameters(
            filter=told,
            contact_max_age=values.contact_max_age,
            max_retired_history=values.max_retired_history,
            max_contacts=values.max_contacts,
            reject_range=values.reject_range,
            decay=values.decay,
            recap_interval=values.recap_interval,
            range_report_timeout=values.range_report_timeout,
            range_report_maxsize=values.range_report_maxsize,
            post_closest_range=values.post_closest_range,
            post_closest_relbng=values.post_closest_relbng,
            post_all_ranges=values.post_all_ranges,
            alert_verbose=values.alert_verbose,
            hold_alerts_for_helm=values.hold_alerts_for_helm,
            early_warning_time=values.early_warning_time,
            early_warning_flags=tuple(values.early_warning_flag),
            cease_warning_flags=tuple(values.cease_warning_flag),
            retire_flags=tuple(values.retire_flag),
        )

    def _mail_handlers(self) -> dict[str, Handler]:
        core, values = self.core, self.config
        handlers: dict[str, Handler] = {
            "NODE_REPORT": self._hear_report,
            "NAV_X": on_level(self, core, "own_x"),
            "NAV_Y": on_level(self, core, "own_y"),
            "NAV_SPEED": on_level(self, core, "own_speed"),
            "NAV_HEADING": on_level(self, core, "own_heading"),
            "IVPHELM_STATE": self._hear_helm,
            "BCM_ALERT_REQUEST": on_text(self, core.request_alert),
            "BCM_REPORT_REQUEST": on_text(self, lambda told: core.requests.ask(told, self.now)),
            "BCM_DISPLAY_RADII": on_truth(self, lambda on: setattr(self, "_display_radii", on)),
        }
        orders = self._orders.handlers(values.disable_var, values.enable_var, values.expunge_var)
        return {**orders, **handlers}

    # --- mail --------------------------------------------------------------------------------

    def _hear_report(self, message: Message) -> None:
        try:
            self.core.receive(message.text, self.now)
        except ValueError as error:
            self.run_warning(f"NODE_REPORT refused: {clip(str(error), 80)}")

    def _hear_helm(self, message: Message) -> None:
        core = self.core
        core.helm_drives = core.helm_drives or message.text.upper().startswith("DRIVE")

    def _ordered(self, action: str) -> None:
        flags = self.config.disable_flag if action == "disable" else self.config.enable_flag
        macros = self._orders.macros()
        for flag in (*self.config.able_flag, *flags):
            self.notify(*flag_post(flag, macros))

    def _draw_radii(self) -> None:
        core = self.core
        widest = max((a.far_range for a in core.alerts.values() if a.is_usable and a.enabled), default=0.0)
        if widest <= 0.0 or core.own_x is None or core.own_y is None:
            return
        looks = Attributes(
            label=f"alert_{self.community}",
            edge_color=self.config.alert_range_color,
            duration=_RADII_DURATION,
        )
        self.notify("VIEW_CIRCLE", circle_text(Circle(core.own_x, core.own_y, widest, looks)))


@mypyc_attr(allow_interpreted_subclasses=True)
class BasicContactManager(ContactManager):
    """pBasicContactMgr of older missions: contacts live longer, and those nobody is alerted about are told."""

    PARAMETERS = CONTACT_MANAGER_DECLARATION + Declaration(
        (
            _number("contact_max_age", 600.0, "s", "Age at which a contact retires.", low=0.0, open_low=True),
            _number("default_alert_range", 1000.0, "m", "Range of alerts that give none.", low=0.0),
        )
    )

    def on_start_up(self) -> None:
        super().on_start_up()
        self._unalerted = ""
        self._give_ranges()

    def iterate(self) -> None:
        self._give_ranges()
        super().iterate()
        idle = ",".join(name for name, each in sorted(self.core.tracked.items()) if not each.alerts)
        if idle != self._unalerted:
            self._unalerted = idle
            self.notify("CONTACTS_UNALERTED", idle)

    def _give_ranges(self) -> None:
        for alert_id, alert in self.core.alerts.items():
            if alert.alert_range is None:
                self.core.alerts[alert_id] = alert.with_alert_range(self.config.default_alert_range)
