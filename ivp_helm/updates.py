"""Run-time updates: `param=value # param=value` applied to a living behaviour (helm.md 7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymoos_lite.config.parameters import ParameterError
from pymoos_lite.geometry.text import num, split_protected

if TYPE_CHECKING:
    from ivp_helm.behavior import Behavior

MAX_UPDATE = 1_000_000
"""Longest update read, characters."""
_NEVER_DUPLICATE = ("toggle", "engage", "mod")


@dataclass(frozen=True, slots=True)
class UpdateResult:
    """What became of one update; `bad` are (parameter, complaint) of pairs that were refused."""

    behavior: str
    variable: str
    result: str
    text: str
    bad: tuple[tuple[str, str], ...] = ()

    def report(self, since_start: float) -> str:
        """The value of IVPHELM_UPDATE_RESULT."""
        return (
            f"bhv={self.behavior},var={self.variable},time={since_start:.2f},"
            f"result={self.result},val={self.text}"
        )


def parse_update(text: str) -> list[tuple[str, str]]:
    """(parameter in lower case, value) of each pair, in order; ``#`` inside quotes or braces separates nothing."""
    pairs = []
    for piece in split_protected(text[:MAX_UPDATE], "#"):
        if piece:
            key, _, value = piece.partition("=")
            pairs.append((key.strip().lower(), value.strip()))
    return pairs


def update_name(text: str) -> str | None:
    """The value of the update's `name` pair, None if it has none."""
    for key, value in parse_update(text):
        if key == "name":
            return value
    return None


def is_repeatable(text: str) -> bool:
    """Whether an update acts again when it is repeated: it holds one of three magic words."""
    lower = text.lower()
    return any(word in lower for word in _NEVER_DUPLICATE)


def names_match(name: str, behavior: str, prefix: str) -> bool:
    """Whether an update addressed to `name` is for the behaviour: by its full name, or short of its template's."""
    return name in (behavior, behavior.removeprefix(prefix)) if prefix else name == behavior


def apply_update(behavior: Behavior, text: str, prefix: str = "") -> UpdateResult:
    """Set what the update says; good pairs stay set even if others are bad."""
    pairs = parse_update(text)
    variable = behavior.config.updates
    for key, value in pairs:
        if key == "name" and not names_match(value, behavior.name, prefix):
            return UpdateResult(behavior.name, variable, "name_mismatch", text)
    bad = []
    for key, value in pairs:
        if key == "name":
            continue
        try:
            behavior.set_parameter(key, value)
        except ParameterError as error:
            bad.append((key, str(error)))
    return UpdateResult(behavior.name, variable, "param_error" if bad else "success", text, tuple(bad))


def seconds_text(value: float) -> str:
    """Seconds as the texts about starvation print them."""
    return num(value, 2)
