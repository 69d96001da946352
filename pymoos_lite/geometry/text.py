"""How numbers, truth values and field lists are written and read in every MOOS-IvP string.

The lowest text layer: geometry specs and message records both stand on it (`records.csp` re-exports it).
Rules are community.md 19. Nothing here raises on any text, and every function is linear in its input.
"""

from __future__ import annotations

import re

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)").fullmatch
_NUMERIC = "+-.0123456789"
_FORMATS = tuple(f"%.{decimals}f" for decimals in range(18))
_INFINITY = float("inf")

TRUE_WORDS = frozenset({"true", "on", "yes"})
FALSE_WORDS = frozenset({"false", "off", "no"})


def num(value: float, decimals: int = 2) -> str:
    """Decimal text with at most `decimals` digits after the point: 2.50 -> 2.5, 3.00 -> 3, -0.001 -> 0.

    Never an exponent. Infinite and undefined values come out as `inf`, `-inf` and `nan`.
    """
    text = _FORMATS[decimals] % value
    if decimals and text[-1] == "0" and value == value:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def fix(value: float, decimals: int = 2) -> str:
    """Decimal text with exactly `decimals` digits after the point, `-0.00` written as `0.00`."""
    text = _FORMATS[decimals] % value
    if text[0] == "-" and not text.strip("-0."):
        return text[1:]
    return text


def is_number(text: str) -> bool:
    """The numeric test: optional sign, digits, at most one point, no exponent; outer blanks allowed."""
    return _NUMBER(text.strip()) is not None


def parse_number(text: str) -> float | None:
    """Value of numeric text as `is_number` understands it, or None; None too when it overflows a float."""
    return plain_number(text.strip())


def plain_number(text: str) -> float | None:
    """As `parse_number` for text without outer blanks."""
    # Of nothing but these characters float() takes just what the numeric test takes, and is asked in a third of
    # the time of a pattern.
    if not text or text.strip(_NUMERIC):
        return None
    try:
        value = float(text)
    except ValueError:
        return None
    return value if -_INFINITY < value < _INFINITY else None


def parse_bool(text: str, current: bool | None = None) -> bool | None:
    """true/on/yes, false/off/no in any case; `toggle` flips `current` where there is one; else None."""
    word = text.strip().lower()
    if word in TRUE_WORDS:
        return True
    if word in FALSE_WORDS:
        return False
    if word == "toggle" and current is not None:
        return not current
    return None


def split_protected(text: str, separator: str = ",", *, quotes: bool = True) -> list[str]:
    """Pieces of text between separators that stand outside braces and double quotes; blanks trimmed.

    A quote or brace that is never closed protects nothing: one stray character must not swallow
    the rest of a report. `quotes=False` is for formats in which a quote is a letter like any other.
    Empty text gives no pieces.
    """
    if not text:
        return []
    if "{" not in text and not (quotes and '"' in text):
        return [piece.strip() for piece in text.split(separator)]
    pieces: list[str] = []
    start = 0
    for at in _separator_positions(text, separator, quotes):
        pieces.append(text[start:at].strip())
        start = at + len(separator)
    pieces.append(text[start:].strip())
    return pieces


def _separator_positions(text: str, separator: str, quotes: bool) -> list[int]:
    """Where `separator` stands outside every closed pair of quotes or braces, in one pass.

    Separators seen inside a pair are held back until it closes (then they were protected and are
    dropped) or the text ends (then the pair never closed and they count after all).
    """
    found: list[int] = []
    held: list[int] = []
    quoted = False
    depth = 0
    marks = '[{}"]|' if quotes else "[{}]|"
    for match in re.finditer(marks + re.escape(separator), text):
        token = match.group()
        if token == separator:
            (held if quoted or depth else found).append(match.start())
        elif token == '"':
            quoted = not quoted
            if not quoted and not depth:
                held.clear()
        elif quoted:
            continue
        elif token == "{":
            depth += 1
        elif depth:
            depth -= 1
            if not depth:
                held.clear()
    found.extend(held)
    return found


def fields(text: str, separator: str = ",") -> list[tuple[str, str]]:
    """(key, value) of each `k=v` piece, split at its first `=`, blanks trimmed, order kept.

    A piece without `=` comes back with an empty value; empty pieces are skipped.
    """
    pairs: list[tuple[str, str]] = []
    for piece in split_protected(text, separator):
        if piece:
            key, _, value = piece.partition("=")
            pairs.append((key.rstrip(), value.lstrip()))
    return pairs


def unquote(text: str) -> str:
    """Text without one pair of enclosing double quotes, blanks trimmed outside them."""
    text = text.strip()
    if len(text) >= 2 and text[0] == '"' and text[-1] == '"':
        return text[1:-1]
    return text


def unbrace(text: str) -> str:
    """Text without one pair of enclosing braces, blanks trimmed."""
    text = text.strip()
    if len(text) >= 2 and text[0] == "{" and text[-1] == "}":
        return text[1:-1].strip()
    return text
