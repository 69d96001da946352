"""The decision domain: an ordered list of evenly spaced variables.

Everything downstream (pieces, slopes, grids, encoded functions) works on the integer indexes of a
domain, never on native values; this module is where the two meet. It knows nothing of functions.
Source: ivp_math.md 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp.errors import IvPError, nearest_spelling

SnapMode = Literal["floor", "ceil", "nearest"]

# A quotient this close to an integer counts as that integer: 0.6 / 0.2 is 3, not 2.9999...
QUOTIENT_SLACK: Final = 1e-9
# The largest number of points of one variable; indexes are stored as 32-bit integers.
MAX_POINTS: Final = 2**30


@dataclass(frozen=True, slots=True)
class Variable:
    """`points` evenly spaced values from `low` to `high`, both ends included.

    Raises `IvPError` when the name is empty or holds a separator, a limit is not finite, the limits
    are reversed, or the count does not fit the limits (one point needs low == high and only then).
    """

    name: str
    low: float
    high: float
    points: int
    delta: float = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        where = f"domain variable {self.name!r}"
        object.__setattr__(self, "low", float(self.low))
        object.__setattr__(self, "high", float(self.high))
        object.__setattr__(self, "points", int(self.points))
        if not self.name or any(c in self.name for c in ",:;@# \t\n"):
            raise IvPError(f"{where}: a name must not be empty or hold blanks or any of , : ; @ #")
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise IvPError(f"{where}: limits must be finite, not {self.low} and {self.high}")
        if self.low > self.high:
            raise IvPError(f"{where}: low {self.low:g} is above high {self.high:g}")
        if not 1 <= self.points <= MAX_POINTS:
            raise IvPError(f"{where}: the number of points must be 1 to {MAX_POINTS}, not {self.points}")
        if (self.points == 1) != (self.low == self.high):
            raise IvPError(
                f"{where}: {self.points} point(s) do not fit the limits {self.low:g} to {self.high:g};"
                " exactly one point goes with equal limits"
            )
        delta = (self.high - self.low) / (self.points - 1) if self.points > 1 else 0.0
        object.__setattr__(self, "delta", delta)

    def value(self, index: int) -> float:
        """The native value at an index; an index outside the variable is an error."""
        if not 0 <= index < self.points:
            raise IvPError(f"domain variable {self.name!r}: no index {index}, only 0 to {self.points - 1}")
        return self.low + self.delta * index

    def values(self) -> NDArray[np.float64]:
        """All native values, shape (points,)."""
        return self.low + self.delta * np.arange(self.points, dtype=np.float64)

    def index(self, value: float, mode: SnapMode = "nearest") -> int:
        """The index of `value`, clipped to the ends; ties of "nearest" go down.

        Quotients within 1e-9 of an integer count as that integer in "floor" and "ceil" (MOOS-IvP does
        not do so and can come out one off for values that lie on the grid).
        """
        if math.isnan(value):
            raise IvPError(f"domain variable {self.name!r}: NaN has no index")
        if value <= self.low:
            return 0
        if value >= self.high:
            return self.points - 1
        quotient = (value - self.low) / self.delta
        if mode == "nearest":
            return math.ceil((value - self.delta / 2 - self.low) / self.delta)
        nearest = round(quotient)
        if abs(quotient - nearest) <= QUOTIENT_SLACK:
            return nearest
        return math.floor(quotient) if mode == "floor" else math.ceil(quotient)

    def snap(self, value: float, mode: SnapMode = "nearest") -> float:
        """The domain value at `index(value, mode)`."""
        return self.value(self.index(value, mode))

    def next_lower(self, value: float, *, wrap: bool = False) -> float:
        """The domain value one step below the "nearest" index; at the bottom `value`, or high if `wrap`."""
        i = self.index(value)
        if i > 0:
            return self.value(i - 1)
        return self.high if wrap else value

    def next_higher(self, value: float, *, wrap: bool = False) -> float:
        """The domain value one step above the "nearest" index; at the top `value`, or low if `wrap`."""
        i = self.index(value)
        if i < self.points - 1:
            return self.value(i + 1)
        return self.low if wrap else value

    def __str__(self) -> str:
        return f"{self.name},{_number(self.low)},{_number(self.high)},{self.points}"


@dataclass(frozen=True, slots=True)
class DomainEntry:
    """One `Domain =` line of a helm configuration: a variable, and whether a decision may lack it."""

    variable: Variable
    optional: bool = False


class Domain:
    """An ordered, immutable list of variables with distinct names.

    Equal domains are one and the same object (same names, order, limits and counts), so comparing and
    hashing cost nothing. Made from variables, or by `Domain.parse` and `Domain.from_entries`.
    """

    __slots__ = (
        "__weakref__",
        "_by_name",
        "_frame",
        "_frame_address",
        "_points_array",
        "_scopes",
        "_subdomains",
        "_width",
        "delta",
        "high",
        "low",
        "names",
        "points",
        "size",
        "variables",
    )
    variables: tuple[Variable, ...]
    names: tuple[str, ...]
    points: tuple[int, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    delta: tuple[float, ...]
    size: int  # total number of points: the product of the counts
    _by_name: dict[str, int]
    _frame: NDArray[np.int64]  # points, and as floats low and delta of each variable, for the solver
    _frame_address: int
    _width: int
    _points_array: NDArray[np.int64]  # points once more, for kernels; never written to
    _subdomains: dict[tuple[str, ...], Domain]
    _scopes: dict[Domain, tuple[NDArray[np.int64], int]]  # scope_of and its address, as kernels want it

    _interned: ClassVar[WeakValueDictionary[tuple[Variable, ...], Domain]] = WeakValueDictionary()

    def __new__(cls, variables: Iterable[Variable]) -> Domain:
        key = tuple(variables)
        found = cls._interned.get(key)
        if found is not None:
            return found
        if not key:
            raise IvPError("domain: it has no variable")
        by_name: dict[str, int] = {}
        for i, variable in enumerate(key):
            if variable.name in by_name:
                raise IvPError(f"domain: variable {variable.name!r} is given twice")
            by_name[variable.name] = i
        self = super().__new__(cls)
        self.variables = key
        self.names = tuple(v.name for v in key)
        self.points = tuple(v.points for v in key)
        self.low = tuple(v.low for v in key)
        self.high = tuple(v.high for v in key)
        self.delta = tuple(v.delta for v in key)
        self.size = math.prod(self.points)
        self._by_name = by_name
        self._points_array = np.array(self.points, dtype=np.int64)
        limits = np.array(self.low + self.delta, dtype=np.float64)
        self._frame = np.concatenate((self._points_array, limits.view(np.int64)))
        self._frame_address = self._frame.ctypes.data
        self._width = len(key)
        self._subdomains = {}
        self._scopes = {}
        cls._interned[key] = self
        return self

    def __reduce__(self) -> tuple[type[Domain], tuple[tuple[Variable, ...]]]:
        return Domain, (self.variables,)

    def __len__(self) -> int:
        return len(self.variables)

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __getitem__(self, name: str) -> Variable:
        return self.variables[self.position(name)]

    def __str__(self) -> str:
        return ":".join(str(v) for v in self.variables)

    def __repr__(self) -> str:
        return f"Domain({str(self)!r})"

    # -- text ------------------------------------------------------------------------------------

    @classmethod
    def parse(cls, text: str, separator: str = ",") -> Domain:
        """Read `course,0,359,360:speed,0,4,21` (with `separator` ";" the form inside an encoded function).

        Blanks around names and numbers are dropped, one trailing ":" is harmless, a fractional count
        is truncated. Anything else wrong raises `IvPError`; there is never a partial domain.
        """
        parts = text.strip().split(":")
        if len(parts) > 1 and not parts[-1].strip():
            parts.pop()
        variables = []
        for part in parts:
            fields = [f.strip() for f in part.split(separator)]
            if len(fields) != 4:
                raise IvPError(
                    f"domain {text!r}: {part.strip()!r} has {len(fields)} field(s);"
                    f" expected name{separator}low{separator}high{separator}points"
                )
            variables.append(_variable(fields[0], fields[1], fields[2], fields[3], part.strip()))
        return cls(variables)

    @classmethod
    def from_entries(cls, entries: Iterable[str]) -> Domain:
        """Read helm configuration entries such as `course:0:359:360` or `speed:0:4:delta=0.2`, one each."""
        return cls(parse_entry(entry).variable for entry in entries)

    def names_text(self) -> str:
        """The names only, `course:speed`."""
        return ":".join(self.names)

    # -- look-up -----------------------------------------------------------------------------------

    def position(self, name: str) -> int:
        """Which variable (0, 1, ...) is called `name`; raises `IvPError` when none is."""
        found = self._by_name.get(name)
        if found is None:
            hint = nearest_spelling(name, self.names) or f"; it has {', '.join(self.names)}"
            raise IvPError(f"variable {name!r} not in domain{hint}")
        return found

    def index_of(self, point: Sequence[float], mode: SnapMode = "nearest") -> tuple[int, ...]:
        """Snap one native value per variable to indexes."""
        if len(point) != len(self.variables):
            raise IvPError(f"domain {self}: a point needs {len(self.variables)} values, not {len(point)}")
        return tuple(v.index(x, mode) for v, x in zip(self.variables, point, strict=True))

    def value_of(self, indexes: Sequence[int]) -> tuple[float, ...]:
        """The native values at one index per variable."""
        if len(indexes) != len(self.variables):
            raise IvPError(f"domain {self}: a point needs {len(self.variables)} indexes, not {len(indexes)}")
        return tuple(v.value(int(j)) for v, j in zip(self.variables, indexes, strict=True))

    # -- parts and unions ----------------------------------------------------------------------------

    def subdomain(self, names: str | Sequence[str]) -> Domain:
        """The named variables, in the order given (a comma list or a sequence of names)."""
        wanted = tuple(n.strip() for n in names.split(",")) if isinstance(names, str) else tuple(names)
        found = self._subdomains.get(wanted)
        if found is None:
            found = self._subdomains[wanted] = Domain(self[name] for name in wanted)
        return found

    def union(self, other: Domain) -> Domain:
        """This domain, then the variables of `other` it lacks; shared variables must agree."""
        for v in other.variables:
            if v.name in self._by_name and self[v.name] != v:
                raise IvPError(
                    f"domain variable {v.name!r} is {self[v.name]} in one domain and {v} in the other"
                )
        return Domain((*self.variables, *(v for v in other.variables if v.name not in self._by_name)))

    def intersects(self, other: Domain) -> bool:
        """Whether the two share a variable name."""
        return any(name in other for name in self.names)

    def has_only(self, *names: str) -> bool:
        """Whether the variables are exactly the given ones, in any order."""
        return set(self.names) == set(names)

    def scope_of(self, part: Domain) -> NDArray[np.int64]:
        """For each variable of `part` its position in this domain, shape (len(part),).

        Raises `IvPError` for a variable this domain lacks or holds with other limits or counts.
        """
        known = self._scopes.get(part)
        if known is None:
            for v in part.variables:
                if v.name not in self._by_name:
                    raise IvPError(f"variable {v.name!r} not in domain {self}")
                if self[v.name] != v:
                    raise IvPError(f"variable {v.name!r} is {v}, but {self[v.name]} in the domain {self}")
            scope = np.array([self._by_name[name] for name in part.names], dtype=np.int64)
            if len(self._scopes) > 256:  # many passing domains: forget, rather than grow for ever
                self._scopes = {}
            known = self._scopes[part] = (scope, scope.ctypes.data)
        return known[0]


def parse_entry(text: str) -> DomainEntry:
    """Read one helm configuration entry: name, low, high, and a count or `delta=X`, then maybe `optional`.

    "," and ":" separate alike. `delta=X` stands for trunc((high - low) / X + 1) points, where a quotient
    within 1e-9 of an integer counts as that integer.
    """
    fields = [f.strip() for f in text.replace(":", ",").split(",")]
    if len(fields) not in (4, 5):
        raise IvPError(f"domain entry {text!r}: {len(fields)} field(s), not name:low:high:points[:optional]")
    optional = False
    if len(fields) == 5:
        if fields[4].lower() != "optional":
            raise IvPError(f"domain entry {text!r}: the fifth field is {fields[4]!r}, not 'optional'")
        optional = True
    head, _, step_text = fields[3].partition("=")
    if step_text:
        if head.strip().lower() != "delta":
            raise IvPError(f"domain entry {text!r}: {fields[3]!r} is neither a count nor delta=X")
        low, high = _real(fields[1], text), _real(fields[2], text)
        step = _real(step_text, text)
        if not (high > low and 0 < step <= high - low):
            raise IvPError(f"domain entry {text!r}: delta must be above 0 and at most {high - low:g}")
        quotient = (high - low) / step
        if quotient >= MAX_POINTS:
            raise IvPError(f"domain entry {text!r}: more than {MAX_POINTS} points")
        steps = round(quotient) if abs(quotient - round(quotient)) <= QUOTIENT_SLACK else math.floor(quotient)
        return DomainEntry(Variable(fields[0], low, high, steps + 1), optional)
    return DomainEntry(_variable(fields[0], fields[1], fields[2], fields[3], text), optional)


def _variable(name: str, low: str, high: str, points: str, where: str) -> Variable:
    count = _real(points, where)
    if abs(count) > 2 * MAX_POINTS:
        raise IvPError(f"domain part {where!r}: more than {MAX_POINTS} points")
    return Variable(name, _real(low, where), _real(high, where), math.trunc(count))


def _real(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise IvPError(f"domain part {where!r}: {text.strip()!r} is not a number")
    return value


def _number(value: float) -> str:
    """At most five decimals, without trailing zeros or a bare trailing point."""
    text = f"{value:.5f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
