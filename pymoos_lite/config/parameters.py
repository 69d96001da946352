"""Declared parameters: one declaration gives parsing, checking, help text and reference docs.

An app or a behaviour lists its `Parameter`s once (name, kind, default, unit, legal range, aliases,
one line of doc). `Declaration.bind` turns configuration lines into typed `Values` and a list of
`Problem`s; nothing is parsed by hand anywhere else (design principle 5).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.problems import Problem, did_you_mean

Kind = Literal["number", "integer", "boolean", "text", "choice", "variable", "custom"]

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")
_TRUE = frozenset({"true", "on", "yes"})
_FALSE = frozenset({"false", "off", "no"})


class ParameterError(ValueError):
    """A parameter's value is not acceptable; the text says what would be."""


@dataclass(frozen=True)
class Parameter:
    """One declared parameter.

    `name` is what a mission file says; `attribute` (default: the name in lower case) is where the
    typed value is found in `Values`. `low` and `high` are inclusive unless `open_low`/`open_high`.
    A `repeated` parameter collects its lines in file order into a list. A `custom` one is parsed
    by `parse`, which raises `ValueError` with a sentence on what would be right.
    """

    name: str
    kind: Kind = "text"
    default: Any = None
    unit: str = ""
    doc: str = ""
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    open_high: bool = False
    choices: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    repeated: bool = False
    clip: bool = False
    parse: Callable[[str], Any] | None = None
    example: str = ""
    attribute: str = ""

    @property
    def key(self) -> str:
        return self.attribute or self.name.lower()

    def read(self, text: str) -> Any:
        """The typed value of `text`.

        Raises:
            ParameterError: it is not a value of this parameter.
        """
        reader = _READERS[self.kind]
        try:
            return reader(self, text.strip())
        except ParameterError:
            raise
        except (ValueError, TypeError, KeyError, IndexError, OverflowError) as error:
            raise ParameterError(f"{self.name} = {text.strip()!r}: {error}") from None

    def legal(self) -> str:
        """The legal values in words, e.g. ``number in [0, 100], m/s``."""
        if self.kind == "choice":
            words = "one of " + ", ".join(self.choices)
        elif self.kind == "boolean":
            words = "true or false"
        elif self.kind == "variable":
            words = "a variable name without blanks"
        elif self.kind in ("number", "integer"):
            words = "a number" if self.kind == "number" else "a whole number"
            words += self._range()
        else:
            words = "text"
        return f"{words}, {self.unit}" if self.unit else words

    def _range(self) -> str:
        low, high = self.low, self.high
        if low is not None and high is not None:
            left, right = "(" if self.open_low else "[", ")" if self.open_high else "]"
            return f" in {left}{low:g}, {high:g}{right}"
        if low is not None:
            return f" above {low:g}" if self.open_low else f" of at least {low:g}"
        if high is not None:
            return f" below {high:g}" if self.open_high else f" of at most {high:g}"
        return ""


def parse_number(text: str) -> float:
    """A finite decimal number.

    Raises:
        ValueError: `text` is something else (``inf``, ``nan`` and ``0x10`` among it).
    """
    if not _NUMBER.match(text):
        raise ValueError("not a number")
    value = float(text)
    if not math.isfinite(value):
        raise ValueError("not a finite number")
    return value


def parse_boolean(text: str) -> bool:
    """``true/on/yes`` or ``false/off/no`` in any case (community.md 19.4).

    Raises:
        ValueError: `text` is none of these.
    """
    word = text.strip().lower()
    if word in _TRUE:
        return True
    if word in _FALSE:
        return False
    raise ValueError("not true or false")


def unquote(text: str) -> str:
    """`text` without one pair of surrounding double quotes."""
    text = text.strip()
    return text[1:-1] if len(text) >= 2 and text[0] == text[-1] == '"' else text


def _read_number(parameter: Parameter, text: str) -> float:
    try:
        value = parse_number(unquote(text))
    except ValueError:
        raise ParameterError(f"{parameter.name} = {text!r} is not {parameter.legal()}") from None
    low, high = parameter.low, parameter.high
    if parameter.clip:
        value = max(value, low) if low is not None else value
        return min(value, high) if high is not None else value
    below = low is not None and (value < low or (parameter.open_low and value == low))
    above = high is not None and (value > high or (parameter.open_high and value == high))
    if below or above:
        raise ParameterError(f"{parameter.name} = {text} is out of range: give {parameter.legal()}")
    return value


def _read_integer(parameter: Parameter, text: str) -> int:
    value = _read_number(parameter, text)
    if value != int(value):
        raise ParameterError(f"{parameter.name} = {text!r} is not {parameter.legal()}")
    return int(value)


def _read_boolean(parameter: Parameter, text: str) -> bool:
    try:
        return parse_boolean(unquote(text))
    except ValueError:
        raise ParameterError(f"{parameter.name} = {text!r} is not true or false") from None


def _read_text(parameter: Parameter, text: str) -> str:
    return unquote(text)


def _read_choice(parameter: Parameter, text: str) -> str:
    word = unquote(text)
    for choice in parameter.choices:
        if choice.lower() == word.lower():
            return choice
    hint = did_you_mean(word, parameter.choices)
    raise ParameterError(f"{parameter.name} = {text!r} is not {parameter.legal()}{hint}")


def _read_variable(parameter: Parameter, text: str) -> str:
    word = unquote(text)
    if not word or re.search(r"\s", word):
        raise ParameterError(f"{parameter.name} = {text!r} is not {parameter.legal()}")
    return word


def _read_custom(parameter: Parameter, text: str) -> Any:
    assert parameter.parse is not None, f"custom parameter {parameter.name} needs a parse function"
    return parameter.parse(text)


_READERS: dict[str, Callable[[Parameter, str], Any]] = {
    "number": _read_number,
    "integer": _read_integer,
    "boolean": _read_boolean,
    "text": _read_text,
    "choice": _read_choice,
    "variable": _read_variable,
    "custom": _read_custom,
}


class Values:
    """Typed parameter values as attributes, one per declared parameter."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.__dict__.update(values)

    if TYPE_CHECKING:
        # Which attributes there are only the declaration knows. (A method here would make each read dearer.)
        def __getattr__(self, name: str) -> Any: ...

    def __repr__(self) -> str:
        return f"Values({self.__dict__})"


@dataclass(frozen=True)
class Declaration:
    """All parameters of one app or behaviour, in the order in which help shows them.

    `ignored` are names accepted without effect (the reference has them, we need them not).
    `open_keys` accepts any further key: it is handed to the owner as an extra line.
    """

    parameters: tuple[Parameter, ...] = ()
    ignored: tuple[str, ...] = ()
    open_keys: Callable[[str], bool] | None = None
    _by_name: dict[str, Parameter] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for parameter in self.parameters:
            for name in (parameter.name, *parameter.aliases):
                if name.lower() in self._by_name:
                    raise ValueError(f"parameter '{name}' is declared twice")
                self._by_name[name.lower()] = parameter

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.parameters)

    def __add__(self, other: Declaration) -> Declaration:
        """Both together; a parameter of `other` replaces one of the same name."""
        taken = {p.name.lower() for p in other.parameters}
        kept = tuple(p for p in self.parameters if p.name.lower() not in taken)
        opens = [k for k in (self.open_keys, other.open_keys) if k is not None]
        both = (lambda key: any(accepts(key) for accepts in opens)) if opens else None
        return Declaration(kept + other.parameters, self.ignored + other.ignored, both)

    def find(self, name: str) -> Parameter | None:
        """The parameter of that name or alias, in any case."""
        return self._by_name.get(name.strip().lower())

    def names(self) -> list[str]:
        """Every accepted name, aliases included."""
        return [n for p in self.parameters for n in (p.name, *p.aliases)]

    def defaults(self) -> Values:
        """Values when no line is given; repeated parameters start empty."""
        return Values({p.key: ([] if p.repeated else p.default) for p in self.parameters})

    def read(self, name: str, text: str) -> tuple[str, Any]:
        """Attribute and typed value of one assignment.

        Raises:
            ParameterError: unknown name or unacceptable value.
        """
        parameter = self.find(name)
        if parameter is None:
            raise ParameterError(f"there is no parameter '{name}'{did_you_mean(name, self.names())}")
        return parameter.key, parameter.read(text)

    def bind(self, lines: Iterable[ConfigLine], owner: str, file: str = "") -> Bound:
        """Read `lines` of `file` for `owner` (an app's or behaviour's name, used in problems' texts).

        A bad value leaves the default in place and is a problem; for a scalar given twice the
        last line wins, with a warning.
        """
        values = self.defaults()
        problems: list[Problem] = []
        extra: list[ConfigLine] = []
        seen: dict[str, ConfigLine] = {}
        for line in lines:
            parameter = self.find(line.key)
            if parameter is None:
                if line.key.lower() in (name.lower() for name in self.ignored):
                    continue
                if self.open_keys is not None and self.open_keys(line.key):
                    extra.append(line)
                    continue
                hint = did_you_mean(line.key, self.names())
                text = f"{owner} has no parameter '{line.key}'{hint}"
                problems.append(Problem(file, line.line, text, "warning"))
                continue
            try:
                value = parameter.read(line.value)
            except ParameterError as error:
                problems.append(Problem(file, line.line, f"{owner}: {error}"))
                continue
            if parameter.repeated:
                values.__dict__[parameter.key].append(value)
                continue
            former = seen.get(parameter.key)
            if former is not None:
                text = f"{owner}: {parameter.name} was already given at line {former.line}; the last one wins"
                problems.append(Problem(file, line.line, text, "warning"))
            seen[parameter.key] = line
            values.__dict__[parameter.key] = value
        return Bound(values, problems, extra, frozenset(seen))


class Bound(NamedTuple):
    """What `Declaration.bind` found; `given` are the attributes of scalars that were set."""

    values: Values
    problems: list[Problem]
    extra: list[ConfigLine]
    given: frozenset[str]


def describe(declaration: Declaration, names: Sequence[str] = ()) -> str:
    """A text table of the parameters, for ``pymoos help`` and the reference pages."""
    rows = []
    for parameter in declaration:
        if names and parameter.name not in names:
            continue
        default = _shown(parameter)
        head = f"  {parameter.name} = {default}" if default else f"  {parameter.name}"
        rows.append(f"{head:<44} {parameter.legal()}{' (repeatable)' if parameter.repeated else ''}")
        also = f" Also: {', '.join(parameter.aliases)}." if parameter.aliases else ""
        if parameter.doc or also:
            rows.append(f"      {parameter.doc}{also}")
    return "\n".join(rows)


def _shown(parameter: Parameter) -> str:
    if parameter.example:
        return parameter.example
    default = parameter.default
    if default is None or default == "":
        return ""
    if isinstance(default, bool):
        return "true" if default else "false"
    return f"{default:g}" if isinstance(default, int | float) else str(default)
