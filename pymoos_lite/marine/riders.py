"""Riders: variables of the community that travel along in the node report (marine_apps.md 3.5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mypy_extensions import mypyc_attr

from pymoos_lite.records.csp import fields, num, parse_number

RESERVED = frozenset(
    {"NAME", "X", "Y", "SPD", "HDG", "DEP", "LAT", "LON"}
    | {"TYPE", "COLOR", "MODE", "ALLSTOP", "INDEX", "YAW", "TIME", "LENGTH"}
)
"""Fields of the report itself, which no rider may take."""


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Rider:
    """What a rider is: the variable, its field in the report, when it is included and its precision.

    `always` includes it in every report once it has a value; otherwise `updated` includes it when mail came
    since the last report, and `every` (s, None for never) when that much time has passed.
    """

    variable: str
    field: str
    always: bool = True
    updated: bool = False
    every: float | None = None
    precision: int = 4


def parse_rider(text: str) -> Rider:
    """`var=V, policy=always|updated|updated+N|N, rfld=F, prec=0..10`; raises ValueError for anything else."""
    given: dict[str, str] = {}
    for key, value in fields(text):
        if key.lower() not in ("var", "policy", "rfld", "prec"):
            raise ValueError(f"'{key}' is none of var, policy, rfld, prec")
        given[key.lower()] = value
    variable = given.get("var", "")
    if not variable or any(c.isspace() for c in variable):
        raise ValueError("a rider needs var = a variable name")
    name = given.get("rfld") or variable
    if variable.upper() in RESERVED or name.upper() in RESERVED:
        raise ValueError(f"'{name}' is a field of the report itself")
    if any(c in name for c in ',= {}"') or any(c.isspace() for c in name):
        raise ValueError(f"'{name}' cannot be the name of a field")
    precision = parse_number(given.get("prec", "4"))
    if precision is None or precision != int(precision) or not 0 <= precision <= 10:
        raise ValueError(f"prec = {given['prec']}: expected a whole number in 0..10")
    always, updated, every = _parse_policy(given.get("policy", "always"))
    return Rider(variable, name, always, updated, every, int(precision))


def _parse_policy(text: str) -> tuple[bool, bool, float | None]:
    word = text.strip().lower()
    if word == "always":
        return True, False, None
    if word == "updated":
        return False, True, None
    updated = word.startswith("updated+")
    seconds = parse_number(word.removeprefix("updated+"))
    if seconds is None or seconds < 0.0:
        raise ValueError(f"policy = {text}: expected always, updated, updated+N or N (seconds)")
    return False, updated, seconds


class RiderSet:
    """All riders of a reporter and the latest value of each."""

    def __init__(self, riders: list[Rider]) -> None:
        self._states = {rider.variable: _RiderState(rider) for rider in riders}

    @property
    def variables(self) -> list[str]:
        """Variables to register for, in the order of their declaration."""
        return list(self._states)

    def hear(self, variable: str, value: float | str) -> None:
        """Take a value of a rider's variable."""
        state = self._states[variable]
        state.value = value
        state.fresh = True

    def take(self, now: float) -> list[tuple[str, str]]:
        """(field, text) of the riders due in a report posted at `now`, which counts as reporting them."""
        due: list[tuple[str, str]] = []
        for state in self._states.values():
            rider, value = state.rider, state.value
            if value is None:
                continue
            waited = rider.every is not None and now - state.reported_at >= rider.every
            if rider.always or (rider.updated and state.fresh) or waited:
                state.fresh = False
                state.reported_at = now
                text = num(value, rider.precision) if isinstance(value, float) else value
                due.append((rider.field, text))
        return due


@dataclass(slots=True)
class _RiderState:
    rider: Rider
    value: float | str | None = None
    fresh: bool = False
    reported_at: float = -math.inf
