"""Flags: the postings that a mission attaches to moments in a behaviour's life (helm.md 4.2, 4.3).

    [@tag ] [#destination ] VAR=VALUE [[if] condition]

A flag is parsed once into a record, its macros (``$[X]`` or ``$(X)``) into parts; expanding asks its owner
for the macros' values and touches nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from ivp_helm.conditions import Condition, ConditionError, parse_condition
from pymoos_lite.core.message import Value
from pymoos_lite.geometry.text import num, parse_number

MacroSource = Callable[[str], "float | str | None"]

DESTINATIONS = ("all", "all+", "group", "group+")
CLEAR = "clearall"
"""The flag text that empties a set of flags."""

_IF = re.compile(r"\[if\]", re.IGNORECASE)
_MACRO = re.compile(r"\$\[([^\[\]$]+)\]|\$\(([^()$]+)\)")


@dataclass(frozen=True, slots=True)
class Macro:
    """A place to be filled in; `text` is how it was written, and stays when nobody knows the name."""

    name: str
    text: str
    bracket: bool


@dataclass(frozen=True, slots=True)
class Flag:
    """One parsed flag. `value` is typed when it holds no macro; `parts` is None then."""

    variable: str
    value: Value
    tag: str = ""
    destination: str = ""
    condition: Condition | None = None
    parts: tuple[str | Macro, ...] | None = None

    @property
    def macros(self) -> tuple[Macro, ...]:
        return tuple(p for p in self.parts or () if isinstance(p, Macro))

    def expand(self, source: MacroSource) -> Value:
        """The value to post: a number if the flag is one macro that is a number, otherwise text."""
        parts = self.parts
        if parts is None:
            return self.value
        if len(parts) == 1 and isinstance(parts[0], Macro):
            found = source(parts[0].name)
            if isinstance(found, float | int) and not isinstance(found, bool):
                return round(float(found), 3)
        return "".join(part if isinstance(part, str) else _shown(part, source) for part in parts)

    def __str__(self) -> str:
        text = f"{self.variable}={_text(self.value)}"
        if self.destination:
            text = f"#{self.destination} {text}"
        if self.tag:
            text = f"{self.tag} {text}"
        return f"{text} [if] {self.condition.text}" if self.condition else text


def _shown(macro: Macro, source: MacroSource) -> str:
    value = source(macro.name)
    if value is None:
        return macro.text
    return value if isinstance(value, str) else num(value, 3)


def _text(value: Value) -> str:
    if isinstance(value, float):
        return num(value, 10)
    text = str(value)
    return f'"{text}"' if parse_number(text) is not None else text


def parse_flag(text: str) -> Flag:
    """Read one flag.

    Raises:
        ValueError: it is none; the text says what would be right.
    """
    body = text.strip()
    tag = destination = ""
    condition = None
    markers = list(_IF.finditer(body))
    if markers:
        try:
            condition = parse_condition(body[markers[-1].end() :])
        except ConditionError as error:
            raise ValueError(f"after [if]: {error}") from None
        body = body[: markers[-1].start()].rstrip()
    if body[:1] in ("@", "<", ">"):
        tag, _, body = body.partition(" ")
        tag, body = tag.lower(), body.lstrip()
    if body.startswith("#"):
        word, _, body = body.partition(" ")
        destination, body = word[1:].lower(), body.lstrip()
        if destination not in DESTINATIONS:
            raise ValueError(
                f"unknown destination '{word}': expected one of {', '.join(DESTINATIONS)} after #"
            )
    variable, equals, value_text = body.partition("=")
    variable, value_text = variable.strip(), value_text.strip()
    if not equals or not variable or not value_text:
        raise ValueError(f"'{text.strip()}' is no flag: expected VARIABLE=VALUE")
    if re.search(r"\s", variable):
        raise ValueError(f"'{variable}' is no variable name: it holds a blank")
    value = typed_value(value_text)
    parts = split_macros(value) if isinstance(value, str) else None
    return Flag(variable, value, tag, destination, condition, parts)


def typed_value(text: str) -> float | str:
    """A number if the text is one, the inside of quotes, or the text itself (helm.md 1.2)."""
    text = text.strip()
    if len(text) >= 2 and text[0] == text[-1] == '"':
        return text[1:-1]
    number = parse_number(text)
    return text if number is None else number


def split_macros(text: str) -> tuple[str | Macro, ...] | None:
    """Text cut at its macros, None if it has none."""
    parts: list[str | Macro] = []
    start = 0
    for match in _MACRO.finditer(text):
        if match.start() > start:
            parts.append(text[start : match.start()])
        bracket = match[1] is not None
        parts.append(Macro(match[1] if bracket else match[2], match[0], bracket))
        start = match.end()
    if not parts:
        return None
    if start < len(text):
        parts.append(text[start:])
    return tuple(parts)
