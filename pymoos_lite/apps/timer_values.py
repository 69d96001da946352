"""What a timer script posts: event lines, random variables, macros and arithmetic in values.

Pure functions and records for `timer_core` (community.md 14.1 and 14.4); randomness comes in as a generator.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from pymoos_lite.records.csp import clip, fields, num, parse_number, split_protected, unbrace, unquote

MAX_COPIES = 10_000
ARITHMETIC_ROUNDS = 11
TIME_RESOLUTION = 10_000
MAX_DRAWS = 10_000

_MACRO = re.compile(r"\$\[(\w+)\]|\$\((\w+)\)")
_INNERMOST = re.compile(r"\{([^{}]*)\}")
_DRAW_KEYS = ("at_start", "at_reset", "at_post")

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Span:
    """A number, or a range to draw one from."""

    low: float
    high: float

    def draw(self, source: random.Random) -> float:
        """A number of the range in steps of a ten-thousandth of it; no draw is used up by a plain number."""
        if self.low == self.high:
            return self.low
        return self.low + (self.high - self.low) * source.randint(0, TIME_RESOLUTION) / TIME_RESOLUTION


def parse_span(text: str) -> Span:
    """`5` or `5:10`. Raises ValueError."""
    parts = [parse_number(part) for part in unquote(text).split(":")]
    low, high = parts[0], parts[-1]
    if low is None or high is None or len(parts) > 2:
        raise ValueError(f"'{clip(text)}' is no time; expected SECONDS or LOW:HIGH")
    if high < low:
        raise ValueError(f"'{clip(text)}': the second number must not be below the first")
    return Span(low, high)


@dataclass(frozen=True, slots=True)
class EventLine:
    """One `event = ...`; `quit` events have no variable. `quoted` values are never numbers."""

    var: str
    value: str
    time: Span
    quoted: bool = False
    amount: int = 1
    quits: bool = False


def parse_event(text: str) -> EventLine:
    """`var=V, val=X, time=T[:T2] [, amt=N]` or `quit, time=T`. Raises ValueError with what would be right."""
    found: dict[str, str] = {}
    for piece in split_protected(text, ","):
        key, equals, value = (part.strip() for part in piece.partition("="))
        key = key.lower()
        if key not in ("var", "val", "time", "amt", "quit") or not (equals or key == "quit"):
            raise ValueError(
                f"Unknown param in event config: '{clip(key)}'; expected var=, val=, time=, amt="
            )
        found[key] = value
    time = parse_span(found.get("time") or "0")
    if "quit" in found:
        return EventLine("", "", time, quits=True)
    name, value = unquote(found.get("var", "")), found.get("val", "")
    if not name or any(c.isspace() for c in name):
        raise ValueError("an event needs var=VARIABLE")
    if not value:
        raise ValueError(f"the event of {name} needs val=VALUE")
    copies = parse_number(found.get("amt", "1"))
    if copies is None or copies != int(copies) or not 1 <= copies <= MAX_COPIES:
        raise ValueError(f"amt={clip(found['amt'])} is no number of copies; expected 1 to {MAX_COPIES}")
    bare = unquote(value)
    return EventLine(name, bare, time, bare != value, int(copies))


@dataclass(frozen=True, slots=True)
class RandomVariable:
    """One `randvar` or `rand_pair`: `draw` gives the texts of `names`; `when` is the draw's occasion."""

    names: tuple[str, ...]
    when: str
    draw: Callable[[random.Random], tuple[str, ...]]


def parse_randvar(text: str) -> RandomVariable:
    """`varname=N, min=a, max=b, key=at_reset [, snap=s] [, type=gaussian, mu=m, sigma=s]`. Raises ValueError."""
    known = ("varname", "min", "max", "key", "snap", "type", "mu", "sigma")
    found = _fields_of(text, known, required=("varname", "min", "max", "key"))
    kind = found.get("type", "uniform").lower()
    low, high = _number(found, "min"), _number(found, "max")
    if high < low:
        raise ValueError(f"max={found['max']} is below min={found['min']}")
    name, when = found["varname"], _occasion(found)
    if kind == "uniform":
        snap = _number(found, "snap") if "snap" in found else 0.001
        if snap < 0:
            raise ValueError(f"snap={found['snap']}: expected a step of at least 0")

        def uniform(source: random.Random) -> tuple[str, ...]:
            value = source.uniform(low, high)
            if snap > 0:
                value = min(max(round(value / snap) * snap, low), high)
            return (num(value, 3),)

        return RandomVariable((name,), when, uniform)
    if kind not in ("gaussian", "normal"):
        raise ValueError(f"type={kind}: expected uniform or gaussian")
    mu, sigma = _number(found, "mu"), _number(found, "sigma")
    if sigma < 0:
        raise ValueError(f"sigma={found['sigma']}: expected at least 0")
    return RandomVariable(
        (name,), when, lambda source: (num(min(max(source.gauss(mu, sigma), low), high), 5),)
    )


def parse_rand_pair(text: str) -> RandomVariable:
    """`var1=A, var2=B, key=at_post, type=poly, poly="pts={0,0:9,0:9,9}"`. Raises ValueError."""
    known = ("var1", "var2", "key", "type", "poly")
    found = _fields_of(text, known, required=("var1", "var2", "key", "poly"))
    if found.get("type", "poly").lower() != "poly":
        raise ValueError(f"type={found['type']}: expected poly")
    corners = parse_corners(found["poly"])
    return RandomVariable(
        (found["var1"], found["var2"]),
        _occasion(found),
        lambda source: tuple(num(v, 3) for v in point_inside(corners, source)),
    )


def _fields_of(text: str, known: Sequence[str], required: Sequence[str]) -> dict[str, str]:
    found = {key.lower(): unquote(value) for key, value in fields(text)}
    for key in found:
        if key not in known:
            raise ValueError(f"'{clip(key)}' is unknown here; expected {', '.join(known)}")
    for key in required:
        if not found.get(key):
            raise ValueError(f"{key}= is missing; needed are {', '.join(required)}")
    return found


def _number(found: Mapping[str, str], key: str) -> float:
    value = parse_number(found.get(key, ""))
    if value is None:
        raise ValueError(f"{key}={clip(found.get(key, ''))}: expected a number")
    return value


def _occasion(found: Mapping[str, str]) -> str:
    when = found["key"].lower()
    if when not in _DRAW_KEYS:
        raise ValueError(f"key={clip(when)}: expected {', '.join(_DRAW_KEYS)}")
    return when


def parse_corners(text: str) -> tuple[Point, ...]:
    """`pts={0,0:9,0:9,9}` (further fields allowed) as corners. Raises ValueError, also for zero area."""
    found = dict(fields(unquote(text)))
    points = []
    for pair in unbrace(found.get("pts", text)).split(":"):
        numbers = [parse_number(part) for part in pair.split(",")]
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
            raise ValueError(f"'{clip(pair)}' is no corner; expected pts={{x,y:x,y:x,y}}")
        points.append((numbers[0], numbers[1]))
    turns = zip(points, points[1:] + points[:1], strict=True)
    if len(points) < 3 or abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in turns)) < 1e-9:
        raise ValueError("a polygon needs at least three corners and an area above 0")
    return tuple(points)


def point_inside(corners: Sequence[Point], source: random.Random) -> Point:
    """A point of the polygon (convex or not), uniform over its area."""
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    for _ in range(MAX_DRAWS):
        point = source.uniform(min(xs), max(xs)), source.uniform(min(ys), max(ys))
        if _is_inside(point, corners):
            return point
    return corners[0]  # only for slivers whose box is ten thousand times as large


def _is_inside(point: Point, corners: Sequence[Point]) -> bool:
    x, y = point
    inside = False
    ax, ay = corners[-1]
    for bx, by in corners:
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
        ax, ay = bx, by
    return inside


def macros_of(text: str) -> tuple[str, ...]:
    """Names of all macros in a value."""
    return tuple(square or paren for square, paren in _MACRO.findall(text))


def expand_value(
    text: str,
    quoted: bool,
    numbers: Mapping[str, float],
    texts: Mapping[str, str],
    source: random.Random,
) -> float | str:
    """The value to post for an event's `text`.

    `numbers` are macros that post a double when they are the whole value (two decimals inside a text, none for
    whole numbers such as counts); `texts` are macros that are only replaced. `$(1)` to `$(20)` are random digits.
    """
    whole = _MACRO.fullmatch(text)
    if whole is not None and not quoted:
        number = numbers.get(whole[1] or whole[2])
        if number is not None:
            return number

    def replacement(match: re.Match[str]) -> str:
        name = match[1] or match[2]
        if name == "VNAME" and match[2]:
            return match[0]
        if name in texts:
            return texts[name]
        if name in numbers:
            value = numbers[name]
            return f"{value:.0f}" if name in ("COUNT", "TCOUNT") else f"{value:.2f}"
        if name.isdecimal() and len(name) < 3 and 1 <= int(name) <= 20 and match[2]:
            return str(source.randrange(10 ** int(name)))
        return match[0]

    result = calculate(_MACRO.sub(replacement, text))
    value = None if quoted else parse_number(result)
    return result if value is None else value


def calculate(text: str) -> str:
    """`text` with its innermost `{a op b}` worked out, up to eleven times; anything else in braces stays."""
    for _ in range(ARITHMETIC_ROUNDS):
        for match in _INNERMOST.finditer(text):
            result = _result(match[1])
            if result is not None:
                text = text[: match.start()] + result + text[match.end() :]
                break
        else:
            return text
    return text


def _result(expression: str) -> str | None:
    for operator in "*/+-":
        at = expression.find(operator)
        while at >= 0:
            # A sign is no operator: the first place with a number on either side counts.
            a, b = parse_number(expression[:at]), parse_number(expression[at + 1 :])
            if a is not None and b is not None:
                return _worked_out(operator, a, b)
            at = expression.find(operator, at + 1)
    return None


def _worked_out(operator: str, a: float, b: float) -> str | None:
    if operator == "/":
        if b == 0:
            return None
        value = a / b
    else:
        value = a * b if operator == "*" else a + b if operator == "+" else a - b
    return num(value, 6) if abs(value) < float("inf") else None
