"""Study files: many seeded runs of one mission over a grid of settings, and what to measure in each.

    study: bloom
    mission: bloom                     # a fleet's file or folder, or a shipped mission
    duration: 7200                     # mission seconds of each run
    presets: [paper, quiet]            # of the fleet file, for every run
    macros: {COMMS_RANGE: 160}         # for every run
    seeds: {first: 1, count: 50}       # or a list; each point of the grid runs with each of them
    grid:                              # or a list of such tables, run one after the other
      vehicles: [4, 6, 8]              # number of vehicles
      method: [gcid, static, greedy]   # a name in small letters: presets
      STORM_INTERVAL: [900, 1800]      # a name in capitals: a macro
    measure:                           # columns, read at the end of a run
      sampled: shoreside SAMPLED_BLOOMS_COMPLETED
      metres: sum N_ODOM_BLOOM_CTRL    # sum, mean, min or max over the vehicles
      hits: shoreside COLLISION_TOTAL or 0
      bytes: network bytes
    derive:
      per_km: 1000 * samples / metres
    compare:                           # paired over equal seeds
      - {column: per_km, factor: method, pairs: [[gcid, static]], within: [vehicles]}
    watch: [hits]                      # columns of which the summary names the rows that are not 0
    row_macros: {LOGGING: full}        # for a single row run again with all its logs

Nothing is run here: this is the file, checked. Rows are numbered from 1 in the order of grids, points, seeds.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from pymoos_lite.config.formulas import Formula, FormulaError, parse_formula
from pymoos_lite.config.problems import Problem, did_you_mean
from pymoos_lite.config.strict_yaml import Listing, Reader, Scalar, Table, Tree, read_yaml

OVER_VEHICLES = ("sum", "mean", "min", "max")
NETWORK = ("bytes", "datagrams", "lost", "squeezed", "unreachable")
MAX_ROWS = 1_000_000
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
RESERVED = frozenset(["row", "seed", "vehicles", "status"])


@dataclass(frozen=True, slots=True)
class Measure:
    """A column read from the communities at the end of a run.

    `place` is a community's name, one of `OVER_VEHICLES`, or ``network``. `default` stands for a
    variable that nobody posted; without one the column stays empty.
    """

    column: str
    place: str
    variable: str
    default: float | None = None


@dataclass(frozen=True, slots=True)
class Comparison:
    """Differences of a column between pairs of a factor's values, at equal seeds and equal `within`."""

    column: str
    factor: str
    pairs: tuple[tuple[str, str], ...]
    within: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Row:
    """One run: its number, seed and factors by name (values as text, in the order of the file)."""

    number: int
    seed: int
    factors: tuple[tuple[str, str], ...]

    def value(self, factor: str) -> str:
        """A factor's value, empty if this row has none of that name."""
        return dict(self.factors).get(factor, "")


@dataclass(frozen=True)
class StudyFile:
    """A checked study file. `grids` are tables of factor to values."""

    file: str
    name: str
    mission: str
    duration: float | None
    presets: tuple[str, ...]
    macros: Mapping[str, str]
    row_macros: Mapping[str, str]
    seeds: tuple[int, ...]
    grids: tuple[Mapping[str, tuple[str, ...]], ...]
    measures: tuple[Measure, ...]
    derived: tuple[tuple[str, Formula], ...]
    comparisons: tuple[Comparison, ...]
    watched: tuple[str, ...]
    problems: tuple[Problem, ...]

    @property
    def factors(self) -> tuple[str, ...]:
        """Names of all factors, in order of appearance."""
        return tuple(dict.fromkeys(name for grid in self.grids for name in grid))

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all measured and derived columns."""
        return (*(m.column for m in self.measures), *(name for name, _ in self.derived))

    def rows(self) -> Iterator[Row]:
        """Every run, in order."""
        number = 0
        for grid in self.grids:
            for values in itertools.product(*grid.values()):
                for seed in self.seeds:
                    number += 1
                    yield Row(number, seed, tuple(zip(grid, values, strict=True)))

    def row(self, number: int) -> Row:
        """One run by its number.

        Raises:
            KeyError: there is none of that number.
        """
        for row in self.rows():
            if row.number == number:
                return row
        raise KeyError(number)

    def in_order(self, numbers: Iterable[int]) -> list[int]:
        """Row numbers in the order in which to run them: all that share the first seed, then the next seed.

        So a study that is stopped early has compared everything, with fewer seeds.
        """
        turn = {seed: place for place, seed in enumerate(self.seeds)}
        wanted = set(numbers)
        chosen = [row for row in self.rows() if row.number in wanted]
        return [row.number for row in sorted(chosen, key=lambda row: (turn[row.seed], row.number))]

    def same_runs(self, other: StudyFile) -> bool:
        """Whether both ask for the same runs and the same columns: `other`'s results are this one's."""
        return self._runs == other._runs

    @property
    def _runs(self) -> tuple[object, ...]:
        derived = [(name, formula.text) for name, formula in self.derived]
        grids = [list(grid.items()) for grid in self.grids]
        plan = (self.mission, self.duration, self.presets, dict(self.macros), self.seeds)
        return (*plan, grids, self.measures, derived)

    @property
    def row_count(self) -> int:
        points = 0
        for grid in self.grids:
            size = 1
            for values in grid.values():
                size *= len(values)
            points += size
        return points * len(self.seeds)


def is_macro(factor: str) -> bool:
    """Whether a factor of that name is a macro; others but ``vehicles`` are presets."""
    return factor.upper() == factor


def parse_study(text: str, file: str) -> StudyFile:
    """Read a study file; never raises, all problems are in the result."""
    problems: list[Problem] = []
    top = Reader(read_yaml(text, file, problems), file, "a study file", problems)
    measures = _measures(top)
    study = StudyFile(
        file=file,
        name=top.text("study", "study"),
        mission=top.text("mission"),
        duration=top.number("duration", 0.0, low=0.0) or None,
        presets=tuple(top.texts("presets")),
        macros=_macros(top, "macros"),
        row_macros=_macros(top, "row_macros"),
        seeds=_seeds(top),
        grids=_grids(top),
        measures=measures,
        derived=_derived(top, [m.column for m in measures]),
        comparisons=(),
        watched=tuple(top.texts("watch")),
        problems=(),
    )
    comparisons = _comparisons(top, study)
    for name in study.watched:
        if name not in study.columns:
            top.problem(top.line_of("watch"), f"watch: no column '{name}'{did_you_mean(name, study.columns)}")
    if not study.mission:
        top.problem(top.line or 1, "mission is missing: which mission is to be run?")
    if not study.measures:
        top.problem(top.line_of("measure"), "measure is missing: nothing would be recorded")
    if study.row_count > MAX_ROWS:
        top.problem(top.line_of("grid"), f"{study.row_count} rows are more than {MAX_ROWS}")
    top.done()
    return StudyFile(
        **{
            **{name: getattr(study, name) for name in study.__dataclass_fields__},
            "comparisons": comparisons,
            "problems": tuple(sorted(set(problems), key=lambda p: (p.line, p.text))),
        }
    )


def _scalar_text(table: Reader, tree: Tree, what: str) -> str:
    """A value as it is written; YAML's own words for true and false are taken literally if they are these."""
    if not isinstance(tree, Scalar):
        table.problem(tree.line, f"{what}: expected one value")
        return ""
    if tree.plain and tree.tag == "bool" and tree.text.lower() not in ("true", "false"):
        table.problem(tree.line, f"{what}: put '{tree.text}' in quotes, or write true or false")
    return "" if tree.plain and tree.tag == "null" else tree.text


def _macros(top: Reader, key: str) -> dict[str, str]:
    table = top.table(key)
    return {name: _scalar_text(table, tree, f"macro {name}") for name, tree in table.entries()}


def _seeds(top: Reader) -> tuple[int, ...]:
    tree = top.get("seeds")
    if isinstance(tree, Listing):
        found = [int(top.as_number(item, "seeds", 0.0, low=0.0)) for item in tree.items]
        if len(set(found)) != len(found):
            top.problem(tree.line, "seeds: one is given twice")
        if not found:
            top.problem(tree.line, "seeds: there is none")
        return tuple(found)
    table = top.table("seeds")
    first = table.integer("first", 1, low=0)
    count = table.integer("count", 1, low=1, high=MAX_ROWS)
    table.done()
    return tuple(range(first, first + count))


def _grids(top: Reader) -> tuple[dict[str, tuple[str, ...]], ...]:
    tree = top.get("grid")
    trees: Sequence[Tree | None] = tree.items if isinstance(tree, Listing) else [tree]
    grids = []
    for item in trees:
        table = Reader(item, top.file, "grid", top.problems)
        grid: dict[str, tuple[str, ...]] = {}
        for factor, values in table.entries():
            line = table.line_of(factor)
            if not _NAME.match(factor) or (factor in RESERVED and factor != "vehicles"):
                table.problem(line, f"grid: '{factor}' cannot be a factor's name")
                continue
            items = values.items if isinstance(values, Listing) else (values,)
            texts = tuple(_scalar_text(table, value, factor) for value in items)
            if not texts or len(set(texts)) != len(texts):
                table.problem(line, f"{factor}: expected a list of different values")
            if factor == "vehicles" and not all(text.isdigit() and int(text) > 0 for text in texts):
                table.problem(line, "vehicles: expected whole numbers above 0")
                texts = ("1",)
            grid[factor] = texts
        grids.append(grid)
    return tuple(grids)


def _measures(top: Reader) -> tuple[Measure, ...]:
    table = top.table("measure")
    found = []
    for column, tree in table.entries():
        line = table.line_of(column)
        words = _scalar_text(table, tree, column).split()
        default = None
        if len(words) == 4 and words[2] == "or":
            default = table.as_number(Scalar(words[3], line), column, 0.0)
            words = words[:2]
        if not _NAME.match(column) or column in RESERVED:
            table.problem(line, f"measure: '{column}' cannot be a column's name")
        elif len(words) != 2:
            table.problem(line, f"{column}: expected PLACE VARIABLE [or NUMBER], e.g. sum NAV_SPEED")
        elif words[0] == "network" and words[1] not in NETWORK:
            hint = did_you_mean(words[1], NETWORK) or f"; known are {', '.join(NETWORK)}"
            table.problem(line, f"{column}: the network does not count '{words[1]}'{hint}")
        else:
            found.append(Measure(column, words[0], words[1], default))
    return tuple(found)


def _derived(top: Reader, known: list[str]) -> tuple[tuple[str, Formula], ...]:
    table = top.table("derive")
    found = []
    for column, tree in table.entries():
        line = table.line_of(column)
        text = _scalar_text(table, tree, column)
        if not _NAME.match(column) or column in RESERVED or column in known:
            table.problem(line, f"derive: '{column}' cannot be a new column's name")
            continue
        try:
            formula = parse_formula(text)
        except FormulaError as error:
            table.problem(line, f"{column}: {error}")
            continue
        for name in formula.names:
            if name not in known and name not in ("vehicles", "seed"):
                table.problem(line, f"{column}: there is no column '{name}'{did_you_mean(name, known)}")
        known.append(column)
        found.append((column, formula))
    return tuple(found)


def _comparisons(top: Reader, study: StudyFile) -> tuple[Comparison, ...]:
    tree = top.get("compare")
    trees = tree.items if isinstance(tree, Listing) else () if tree is None else (tree,)
    found = []
    for item in trees:
        table = Reader(item, top.file, "compare", top.problems)
        column, factor = table.text("column"), table.text("factor")
        within = tuple(table.texts("within"))
        if column not in study.columns:
            table.problem(table.line, f"compare: no column '{column}'{did_you_mean(column, study.columns)}")
        for name in (factor, *within):
            if name not in study.factors:
                table.problem(table.line, f"compare: no factor '{name}'{did_you_mean(name, study.factors)}")
        values = {value for grid in study.grids for value in grid.get(factor, ())}
        pairs = []
        listing = table.get("pairs")
        for pair in listing.items if isinstance(listing, Listing) else ():
            names = pair.items if isinstance(pair, Listing) else ()
            texts = [_scalar_text(table, name, "pairs") for name in names]
            if len(texts) != 2 or not values.issuperset(texts):
                table.problem(pair.line, f"pairs: expected two of {', '.join(sorted(values)) or 'no values'}")
            else:
                pairs.append((texts[0], texts[1]))
        if not pairs and not isinstance(listing, Table):
            table.problem(table.line, "compare: pairs is missing: e.g. [[gcid, static]]")
        table.done()
        found.append(Comparison(column, factor, tuple(pairs), within))
    return tuple(found)
