"""The base of behaviours about one contact: finding it, watching the encounter, knowing when to end.

A complete one:

    class KeepAway(ContactBehavior):
        '''Heads straight away from the contact.'''

        BHV_NAME = "BHV_KeepAway"
        VARIABLES = ("course",)

        def decide(self, meeting: RelativeState) -> IvPFunction | None:
            self.relevance = 1.0 if meeting.range < 100.0 else 0.0
            return zaic_peak(self.domain, "course", Peak(angle360(meeting.engine.bng_cn_os), 0, 180))

The contact is where the helm's ledger says, which is where it was last reported. Before anything else in
an iteration, whatever the state, `meeting` is renewed and contact flags (``cnflag``) are posted. Hooks, in
the order in which they are called; each only while the contact is known:

    look           every iteration, whatever the state: per-contact posts
    exit_reason    every iteration: why the behaviour is done, None while it is not
    decide         conditions hold: an objective function, or None for no opinion

Source: behaviors.md B4, helm.md 4.5 and 11.3. Metres, degrees clockwise from north, m/s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from mypy_extensions import mypyc_attr
from numpy.typing import NDArray

from ivp_helm.base_parameters import BASE_PARAMETERS
from ivp_helm.bearing_line import BearingLine
from ivp_helm.behavior import Behavior
from ivp_helm.contact_parameters import CONTACT_PARAMETERS, FILTER_LISTS
from ivp_helm.contacts import Contact
from ivp_helm.flags import Flag
from ivp_helm.ivp import IvPFunction
from ivp_helm.surroundings import Surroundings
from pymoos_lite.config.parameters import ParameterError
from pymoos_lite.geometry.encounter import ContactTag, EncounterHistory, RelativeState
from pymoos_lite.geometry.specs import erase_seglist_text
from pymoos_lite.geometry.text import num
from pymoos_lite.marine.contact_filter import ContactFilter

UNSET_OK = "unset_ok"
"""The contact's name that a template gives to have no complaint while it is unset."""

_STATE_MACROS: dict[str, Callable[[RelativeState], float | bool]] = {
    "CNX": lambda m: m.cnx,
    "CNY": lambda m: m.cny,
    "CNH": lambda m: m.cnh,
    "CNV": lambda m: m.cnv,
    "CN_RANGE": lambda m: round(m.range, 1),
    "RANGE": lambda m: round(m.range, 1),
    "ROC": lambda m: m.roc,
    "OS_CN_REL_BNG": lambda m: m.os_cn_rel_bng,
    "CN_OS_REL_BNG": lambda m: m.cn_os_rel_bng,
    "BNG_RATE": lambda m: m.bng_rate,
    "CN_SPD_IN_OS_POS": lambda m: m.cn_spd_in_os_pos,
    "OS_FORE_OF_CN": lambda m: m.os_fore_of_cn,
    "OS_AFT_OF_CN": lambda m: m.os_aft_of_cn,
    "OS_PORT_OF_CN": lambda m: m.os_port_of_cn,
    "OS_STAR_OF_CN": lambda m: m.os_star_of_cn,
    "CN_FORE_OF_OS": lambda m: m.cn_fore_of_os,
    "CN_AFT_OF_OS": lambda m: m.cn_aft_of_os,
    "CN_PORT_OF_OS": lambda m: m.cn_port_of_os,
    "CN_STAR_OF_OS": lambda m: m.cn_star_of_os,
}


@mypyc_attr(allow_interpreted_subclasses=True)
class ContactBehavior(Behavior):
    """Base of behaviours about one contact; see the module."""

    BASE_PARAMETERS = BASE_PARAMETERS + CONTACT_PARAMETERS
    ALERTS: ClassVar[bool] = True
    """Whether a template asks the contact manager for alerts, unless ``no_alert_request`` says otherwise."""

    def __init__(self, surroundings: Surroundings, name: str = "") -> None:
        self.contact: Contact | None = None
        """What the ledger knows of the contact, None while that is nothing."""
        self.meeting: RelativeState | None = None
        """Own ship and the contact in this iteration, None without the contact."""
        self.history = EncounterHistory()
        """The last few meetings, kept while there are contact flags."""
        self._tags: list[tuple[ContactTag, Flag]] = []
        self.filter = ContactFilter()
        """The contacts to match and to ignore."""
        self._line_drawn = False
        self._met = ""
        self._complained = False
        super().__init__(surroundings, name)

    # --- hooks of contact behaviours ----------------------------------------------------------------------

    def look(self, meeting: RelativeState) -> None:
        """Called every iteration, whatever the state."""

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        """Conditions hold: what do you want? Set `relevance` as well."""
        return None

    def exit_reason(self, meeting: RelativeState) -> str | None:
        """Why the behaviour is done with this contact (may be empty), None while it is not.

        Here: a filter that no longer passes and whose ``exit_on_filter_*`` is on.
        """
        config, contact = self.config, self.contact
        if contact is None:
            return None
        if config.exit_on_filter_vtype and not self.filter.passes_word("type", contact.type):
            return "filter_vtype"
        if config.exit_on_filter_group and not self.filter.passes_word("group", contact.report.group):
            return "filter_group"
        if config.exit_on_filter_region and not self.filter.passes_place(contact.x, contact.y):
            return "filter_region"
        return None

    def alert_ranges(self) -> tuple[float, float] | None:
        """Alert range and projected-CPA range to ask the contact manager for; None asks for nothing."""
        return None

    # --- what this base lends -----------------------------------------------------------------------------

    @property
    def turns_at_once(self) -> bool:
        """Whether closest approaches take own ship to be on its new course at once."""
        return not self.config.use_plat_model or bool(self.surroundings.platform.model.is_holonomic)

    def cpa_table(self, meeting: RelativeState, horizon: float) -> NDArray[np.float64]:
        """Closest point of approach for every course and speed of the domain: shape (courses, speeds).

        With ``use_plat_model`` along own ship's turn onto each course, otherwise as if it turned at once.
        """
        courses, speeds = self.domain["course"].values(), self.domain["speed"].values()
        if self.turns_at_once:
            return meeting.engine.cpa_grid(courses, speeds, horizon)
        model = self.surroundings.platform.model
        table: NDArray[np.float64] = model.cpa_grid(meeting.engine, courses, speeds, horizon)
        return table

    # --- the life of a behaviour --------------------------------------------------------------------------

    def on_helm_start(self) -> None:
        config = self.config
        ranges = self.alert_ranges()
        wanted = self.ALERTS and not vars(config).get("no_alert_request", False)
        if self.is_template and config.updates and wanted and ranges is not None:
            near, far = ranges
            text = f"id={self.name}, on_flag={config.updates}=name=$[VNAME] # contact=$[VNAME]"
            text += f",alert_range={num(near, 1)}, cpa_range={num(far, 1)}"
            self.post(
                "BCM_ALERT_REQUEST", text + "".join(f", {item}" for item in self._filter_items()), repeat=True
            )

    def on_every_state(self) -> None:
        contact = self.contact = self._find_contact()
        if contact is None:
            self.meeting = None
            return
        own = self.own
        meeting = self.meeting = RelativeState(
            own.x, own.y, own.heading, own.speed, contact.x, contact.y, contact.heading, contact.speed
        )
        if self._met != contact.name:
            self._met = contact.name
            self.history.clear()
        if self._tags:
            self.history.add(meeting)
            self.post_flags(flag for tag, flag in self._tags if self.history.due(tag))
        self.look(meeting)

    def on_idle(self) -> None:
        self._end_if_due()

    def on_disabled(self) -> None:
        self._end_if_due()

    def on_run(self) -> IvPFunction | None:
        meeting = self.meeting
        if meeting is None:
            self._complain()
            return None
        if self._end_if_due():
            return None
        function = self.decide(meeting)
        if function is not None and self.relevance > 0.0:
            self._draw_line(meeting)
        return function

    def on_inactive(self) -> None:
        self._erase_line()

    def on_run_to_idle(self) -> None:
        self._erase_line()

    def on_complete(self) -> None:
        self._erase_line()

    def complete(self, reason: str = "") -> None:
        """As in the base; the post mortem also says how far off the contact was, and where."""
        if self.meeting is not None:
            where = f"rng={self.meeting.range:.1f}#bng={self.meeting.engine.bng_os_cn:.1f}"
            reason = f"{reason}#{where}" if reason else where
        super().complete(reason)

    def macro(self, name: str) -> float | str | None:
        reader = _STATE_MACROS.get(name)
        if reader is not None:
            if self.meeting is None:
                return None
            value = reader(self.meeting)
            return ("true" if value else "false") if isinstance(value, bool) else value
        if name == "CN_NAME":
            return str(self.config.contact)
        if self.contact is not None and name in ("CN_VTYPE", "CN_GROUP"):
            return self.contact.type if name == "CN_VTYPE" else self.contact.report.group
        return None

    # --- parameters ---------------------------------------------------------------------------------------

    def set_parameter(self, name: str, text: str) -> None:
        super().set_parameter(name, text)
        parameter = self.declaration().find(name)
        key = parameter.key if parameter is not None else ""
        if key in FILTER_LISTS or key == "strict_ignore":
            try:
                self.filter = self._read_filter()
            except ValueError as error:
                getattr(self.config, key).pop()
                raise ParameterError(f"{name} = {text.strip()!r}: {error}") from None
        elif key == "cnflag":
            self._tags = [(ContactTag.parse(flag.tag), flag) for flag in self.config.cnflag]

    def set_pair(self, near: str, far: str, given: str, value: float) -> None:
        """Set one of two distances that are to stay in order; the other one is dragged along."""
        values = vars(self.config)
        values[given] = value
        if values[near] > values[far]:
            values[far if given == near else near] = value

    def _read_filter(self) -> ContactFilter:
        found = ContactFilter(strict=self.config.strict_ignore)
        for key in FILTER_LISTS:
            for value in getattr(self.config, key):
                found = found.with_entry(key, value)
        return found

    def _filter_items(self) -> list[str]:
        """The filter as an alert request names it."""
        items = []
        for key in FILTER_LISTS:
            for value in getattr(self.config, key):
                items.append(f"{key}={{{value}}}" if "," in value and "{" not in value else f"{key}={value}")
        if "strict_ignore" in self.given:
            items.append(f"strict_ignore={'true' if self.config.strict_ignore else 'false'}")
        return items

    # --- parts --------------------------------------------------------------------------------------------

    def _find_contact(self) -> Contact | None:
        found: Contact | None = self.surroundings.contacts.get(self.config.contact)
        self._complained = False
        if found is None:
            if self._complaint not in self._warned:
                self._complain()
        elif self._warned:
            self.retract_warning(self._complaint)
        return found

    def _complain(self) -> None:
        """Say once per iteration that there is no such contact."""
        if self._complained or self.config.contact.lower() == UNSET_OK:
            return
        self._complained = True
        if self.config.on_no_contact_ok:
            self.warn(self._complaint)
        else:
            self.error(self._complaint)

    @property
    def _complaint(self) -> str:
        return f"{self.config.contact} x/y/heading/speed info not found"

    def _end_if_due(self) -> bool:
        if self.meeting is not None and not self.completed:
            reason = self.exit_reason(self.meeting)
            if reason is not None:
                self.complete(reason)
                return True
        return self.completed

    def _draw_line(self, meeting: RelativeState) -> None:
        config = self.config
        line = config.bearing_line_config
        if not self.visuals or not (line is not None or config.bearing_line_show):
            return
        line = line or BearingLine()
        index = meeting.range if line.info == "range" else self.relevance
        ends = ((meeting.osx, meeting.osy), (meeting.cnx, meeting.cny))
        named = config.bearing_line_label_show
        self.post("VIEW_SEGLIST", line.text(self._line_label, ends, index, self.now, named), "bearing")
        self._line_drawn = True

    def _erase_line(self) -> None:
        if self._line_drawn:
            self._line_drawn = False
            self.post("VIEW_SEGLIST", erase_seglist_text(self._line_label), "bearing")

    @property
    def _line_label(self) -> str:
        return f"{self.community}_{self.name}"


def graded(value: float, near: float, far: float, grade: str = "linear") -> float:
    """How relevant something `value` away is: 1 up to `near`, 0 from `far`, in between by the grade.

    The grades are powers of the share of the way in: linear 1, quasi 1.5, quadratic 2 (behaviors.md C6).
    """
    if value >= far:
        return 0.0
    if value <= near or math.isclose(near, far):
        return 1.0
    share = (far - value) / (far - near)
    return float(share ** _POWERS[grade])


_POWERS = {"linear": 1.0, "quasi": 1.5, "quadratic": 2.0}
GRADES = tuple(_POWERS)
