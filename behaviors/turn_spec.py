"""The schedule of turns of BHV_FixedTurn (behaviors.md C18)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ivp_helm.flags import Flag, parse_flag
from pymoos_lite.config.parameters import parse_number
from pymoos_lite.geometry.text import split_protected

SIDES = {"port": "port", "left": "port", "star": "star", "starboard": "star", "right": "star", "auto": "auto"}
_NUMBERS = {
    "spd": "speed",
    "mhdg": "mod_heading",
    "mod_hdg": "mod_heading",
    "fhdg": "turn",
    "fix": "turn",
    "timeout": "timeout",
}


@dataclass(frozen=True, slots=True)
class TurnSpec:
    """One turn of the schedule; what is None is taken from the behaviour's own parameters.

    `speed` m/s, `mod_heading` degrees off the bow to ask for, `turn` degrees to turn in all, `timeout`
    seconds.
    """

    key: str = ""
    speed: float | None = None
    mod_heading: float | None = None
    turn: float | None = None
    side: str | None = None
    timeout: float | None = None
    flags: tuple[Flag, ...] = ()


@dataclass(frozen=True, slots=True)
class ClearTurns:
    """Empties the schedule; `then` is the turn to begin a new one with."""

    then: TurnSpec | None = None


def read_side(text: str) -> str:
    """``port``, ``star`` or ``auto``, which turns to the other side than the last time."""
    side = SIDES.get(text.strip().lower())
    if side is None:
        raise ValueError(f"'{text.strip()}': expected one of {', '.join(SIDES)}")
    return side


def read_turn_spec(text: str) -> TurnSpec | ClearTurns:
    """``spd=2,mhdg=30,fix=180,turn=port,timeout=60,key=a,flag=VAR=val``, or ``clear[,...]``."""
    pieces = split_protected(text, ",")
    if pieces and pieces[0].lower() in ("clear", "clearall"):
        return ClearTurns(_turn(pieces[1:]) if len(pieces) > 1 else None)
    return _turn(pieces)


def _turn(pieces: list[str]) -> TurnSpec:
    spec = TurnSpec()
    for piece in pieces:
        key, equals, value = (part.strip() for part in piece.partition("="))
        key = key.lower()
        if not equals or not value:
            raise ValueError(f"'{piece.strip()}': expected key=value")
        if key == "flag":
            spec = replace(spec, flags=(*spec.flags, parse_flag(value)))
        elif key == "key":
            spec = replace(spec, key=value)
        elif key in ("tdir", "turn"):
            spec = replace(spec, side=read_side(value))
        elif key == "spd" and value.lower() == "auto":
            continue
        elif key in _NUMBERS:
            number = parse_number(value)
            if number < 0.0 and not (key == "timeout" and number == -1.0):
                raise ValueError(f"'{piece.strip()}' must not be negative")
            changes: dict[str, Any] = {_NUMBERS[key]: number}
            spec = replace(spec, **changes)
        else:
            raise ValueError(f"there is no '{key}'; a turn has spd, mhdg, fix, turn, timeout, key, flag")
    return spec


class Schedule:
    """Turns one after the other; one whose key is known replaces that turn."""

    def __init__(self) -> None:
        self.turns: list[TurnSpec] = []
        self.index = 0

    def take(self, spec: TurnSpec | ClearTurns) -> None:
        """Add, replace or clear."""
        if isinstance(spec, ClearTurns):
            self.turns.clear()
            self.index = 0
            if spec.then is None:
                return
            spec = spec.then
        for i, known in enumerate(self.turns):
            if spec.key and known.key == spec.key:
                self.turns[i] = spec
                return
        self.turns.append(spec)

    def current(self) -> TurnSpec | None:
        """The turn due; without any schedule one that takes everything from the parameters; None at the end."""
        if not self.turns:
            return TurnSpec()
        return self.turns[self.index] if self.index < len(self.turns) else None

    def advance(self, repeat: bool) -> None:
        """That turn is done."""
        if self.turns:
            self.index += 1
            if repeat:
                self.index %= len(self.turns)
