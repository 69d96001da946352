"""Alerts: what to post when a contact comes near, and when it no longer is (marine_apps.md 5.2)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

from mypy_extensions import mypyc_attr

from pymoos_lite.marine.contact_filter import FILTER_KEYS, ContactFilter
from pymoos_lite.records.csp import clip, parse_number, split_protected, unquote

NO_ID = "no_id"
MAX_TEXT = 4096
_MACRO = re.compile(r"\$\[(\w+)\]|\$\((\w+)\)|%\[(\w+)\]|%\((\w+)\)")


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Alert:
    """An alert of one id.

    `alert_range` R and `cpa_range` F in metres (None while not set): a contact within R is always alerted,
    between R and F only while its projected closest point is within R. Flags are `VAR=value` texts with macros.
    """

    id: str = NO_ID
    on_flags: tuple[str, ...] = ()
    off_flags: tuple[str, ...] = ()
    alert_range: float | None = None
    cpa_range: float | None = None
    filter: ContactFilter = field(default_factory=ContactFilter)
    enabled: bool = True

    @property
    def is_usable(self) -> bool:
        """Whether the alert has a range and something to post."""
        return self.alert_range is not None and bool(self.on_flags or self.off_flags)

    @property
    def far_range(self) -> float:
        """The range beyond which the alert never applies."""
        return max(self.alert_range or 0.0, self.cpa_range or 0.0)

    def with_alert_range(self, value: float) -> Alert:
        """With another R; F is raised to it."""
        return replace(self, alert_range=value, cpa_range=max(value, self.cpa_range or 0.0))

    def with_cpa_range(self, value: float) -> Alert:
        """With another F; R is lowered to it."""
        near = self.alert_range
        return replace(self, cpa_range=value, alert_range=None if near is None else min(near, value))


def apply_request(text: str, alerts: dict[str, Alert]) -> Alert:
    """Take `id=..,on_flag=VAR=value,alert_range=..`; lines with the same id add to each other.

    Returns the alert as it then is, and puts it into `alerts`.

    Raises:
        ValueError: the request is faulty; nothing is changed.
    """
    if len(text) > MAX_TEXT:
        raise ValueError(f"an alert request of {len(text)} characters is longer than {MAX_TEXT}")
    pairs = _pairs(text)
    told_id = next((value for key, value in pairs if key == "id"), NO_ID) or NO_ID
    alert = alerts.get(told_id, Alert(told_id))
    action = next((value.lower() for key, value in pairs if key == "action"), "")
    if action:
        if action not in ("enable", "disable"):
            raise ValueError(f"action={action}: expected enable or disable")
        if told_id not in alerts:
            raise ValueError(f"there is no alert '{clip(told_id)}' to {action}")
        alerts[told_id] = replace(alert, enabled=action == "enable")
        return alerts[told_id]
    legacy_variable = legacy_value = None
    for key, value in pairs:
        if key == "id":
            continue
        if key in ("on_flag", "onflag"):
            alert = replace(alert, on_flags=_added(alert.on_flags, [value]))
        elif key in ("off_flag", "offflag"):
            alert = replace(alert, off_flags=_added(alert.off_flags, value.split("#")))
        elif key == "var":
            legacy_variable = value
        elif key in ("val", "pattern"):
            legacy_value = value
        elif key in ("alert_range", "cpa_range"):
            number = parse_number(value)
            if number is None or number < 0.0:
                raise ValueError(f"{key}={clip(value)}: expected metres, not negative")
            alert = alert.with_alert_range(number) if key == "alert_range" else alert.with_cpa_range(number)
        elif key in FILTER_KEYS:
            alert = replace(alert, filter=alert.filter.with_entry(key, value))
        else:
            raise ValueError(f"'{clip(key)}' is no part of an alert")
    if legacy_variable is not None and legacy_value is not None:
        alert = replace(alert, on_flags=_added(alert.on_flags, [f"{legacy_variable}={legacy_value}"]))
    alerts[told_id] = alert
    return alert


def _pairs(text: str) -> list[tuple[str, str]]:
    pairs = []
    for piece in split_protected(text):
        if not piece:
            continue
        key, equals, value = piece.partition("=")
        if not equals:
            raise ValueError(f"expected key=value, found '{clip(piece)}'")
        pairs.append((key.strip().lower(), unquote(value)))
    return pairs


def _added(flags: tuple[str, ...], more: list[str]) -> tuple[str, ...]:
    """Flags with further ones, leaving out those that differ only in blanks around separators."""
    known = {_bare(flag) for flag in flags}
    kept = list(flags)
    for flag in more:
        flag = flag.strip()
        if not flag:
            continue
        variable, equals, _ = flag.partition("=")
        if not equals or not variable.strip() or any(c.isspace() for c in variable.strip()):
            raise ValueError(f"flag '{clip(flag)}': expected VAR=value")
        if _bare(flag) not in known:
            known.add(_bare(flag))
            kept.append(flag)
    return tuple(kept)


def _bare(flag: str) -> str:
    return re.sub(r"\s*([#,=])\s*", r"\1", flag.strip())


def expand(text: str, macros: dict[str, str]) -> str:
    """`text` with `$[NAME]`, `$(NAME)` replaced, `%[NAME]` in lower case; unknown macros stay as they are."""

    def value(match: re.Match[str]) -> str:
        told = match.group(1) or match.group(2)
        if told is not None:
            return macros.get(told, match.group(0))
        found = macros.get(match.group(3) or match.group(4))
        return match.group(0) if found is None else found.lower()

    return _MACRO.sub(value, text)


def flag_post(flag: str, macros: dict[str, str]) -> tuple[str, float | str]:
    """(variable, value) of a flag: quoted text is text, numeric text a number, the rest text."""
    variable, _, value = flag.partition("=")
    variable = expand(variable.strip(), macros)
    value = value.strip()
    quoted = len(value) >= 2 and value[0] == value[-1] == '"'
    value = expand(unquote(value), macros)
    number = None if quoted else parse_number(value)
    return variable, value if number is None else number
