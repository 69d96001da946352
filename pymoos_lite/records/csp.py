"""Comma-separated pairs: the text layer under every record, and the one error records raise.

`RecordError` is the only exception that parsing any record can raise, whatever the text.
`Flag` is the `VAR=value` posting that configurations of apps and behaviours write (community.md 19.2).
"""

from __future__ import annotations

from dataclasses import dataclass

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.text import (
    fields,
    fix,
    is_number,
    num,
    parse_bool,
    parse_number,
    split_protected,
    unbrace,
    unquote,
)

__all__ = [
    "MAX_TEXT",
    "Flag",
    "RecordError",
    "balanced",
    "clip",
    "field_map",
    "fields",
    "fix",
    "is_number",
    "num",
    "parse_bool",
    "parse_flag",
    "parse_number",
    "printable",
    "split_protected",
    "unbrace",
    "unquote",
]

# Longer texts are refused unread: the largest honest record (an appcast, a grid) stays far below.
MAX_TEXT = 1 << 20


class RecordError(ValueError):
    """A text that is not the record it should be. One line: which record, what is wrong, where.

    `record` is the format's name (NODE_REPORT ...), `reason` what is wrong without that name.
    """

    def __init__(self, record: str, reason: str) -> None:
        super().__init__(f"{record}: {reason}")
        self.record = record
        self.reason = reason


def clip(text: str, length: int = 60) -> str:
    """Text made fit to stand in a one-line message: control characters blanked, cut to length."""
    head = "".join(c if c.isprintable() else " " for c in text[:length])
    return head if len(text) <= length else head + "..."


def field_map(record: str, text: str, separator: str = ",") -> dict[str, str]:
    """Values by lower-case key; the last of a repeated key wins.

    Raises RecordError when the text is longer than MAX_TEXT or a piece has no `=`.
    """
    if len(text) > MAX_TEXT:
        raise RecordError(record, f"text of {len(text)} characters is longer than {MAX_TEXT}")
    values: dict[str, str] = {}
    for piece in split_protected(text, separator):
        if not piece:
            continue
        key, equals, value = piece.partition("=")
        if not equals:
            raise RecordError(record, f"expected key=value, found '{clip(piece)}'")
        values[key.rstrip().lower()] = value.lstrip()
    return values


def balanced(value: str) -> str:
    """The value, without its braces when they do not pair up: no more braces could protect it then."""
    depth = 0
    for c in value:
        if c == "{":
            depth += 1
        elif c == "}":
            depth -= 1
            if depth < 0:
                break
    return value.replace("{", "").replace("}", "") if depth else value


def printable(value: str) -> str:
    """A value made safe to stand between commas: `balanced`, and braced when a comma of its own is bare."""
    if "{" in value or "}" in value:
        value = balanced(value).strip()
    if "," not in value or len(split_protected(value, quotes=False)) == 1:
        return value
    return "{" + value + "}"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Flag:
    """A posting `VAR=value`: the value is a number, or text that stays text."""

    var: str
    value: float | str

    def to_text(self) -> str:
        """`VAR=value`; text that would read back as a number, or would lose quotes or blanks, is quoted."""
        if isinstance(self.value, str):
            plain = (
                self.value == self.value.strip() and not is_number(self.value) and '"' not in self.value[:1]
            )
            return f"{self.var}={self.value}" if plain else f'{self.var}="{self.value}"'
        return f"{self.var}={num(self.value, 8)}"

    def __str__(self) -> str:
        return self.to_text()


def parse_flag(text: str) -> Flag:
    """`VAR=value`: the first `=` splits, quoted text is text, numeric text a number, the rest text.

    Raises RecordError without `=`, or when the variable is empty or contains blanks.
    """
    var, equals, value = text.partition("=")
    var = var.strip()
    value = value.strip()
    if not equals or not var or any(c.isspace() for c in var):
        raise RecordError("flag", f"expected VAR=value, found '{clip(text)}'")
    if len(value) >= 2 and value[0] == '"' and value[-1] == '"':
        return Flag(var, value[1:-1])
    number = parse_number(value)
    return Flag(var, value if number is None else number)
