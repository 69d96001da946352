"""What a study says: means for each point of the grid, and paired differences with their uncertainty.

Runs of equal seed and equal other factors are compared with each other, so that what the seed alone brings
(the same weather for all) drops out. Two-sided; nothing is corrected for the number of comparisons.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from statistics import fmean, stdev

from pymoos_lite.config.study_file import Comparison, Row, StudyFile
from pymoos_lite.hosts.study import Outcome

CONFIDENCE = 0.95
WATCHED_ROWS = 20
"""Rows named for a watched column; the table has them all."""
Results = Sequence[tuple[Row, Outcome]]


@dataclass(frozen=True, slots=True)
class Paired:
    """Differences `first` minus `second` of one column at equal seeds.

    `low` and `high` are the 95 % confidence interval of the mean difference (Student's t), `p_t` the paired
    t test's, `p_wilcoxon` the signed-rank test's probability of a difference that large by chance. None where
    there are too few pairs, or no differences at all.
    """

    column: str
    within: tuple[tuple[str, str], ...]
    first: str
    second: str
    pairs: int
    first_mean: float
    second_mean: float
    difference: float
    low: float | None
    high: float | None
    p_t: float | None
    p_wilcoxon: float | None
    wins: int
    ties: int


def paired(results: Results, comparison: Comparison) -> list[Paired]:
    """All differences that a comparison asks for, for each group of its `within`."""
    found = []
    for group in _groups(results, comparison.within):
        for first, second in comparison.pairs:
            sides: list[dict[object, float]] = [{}, {}]
            for row, outcome in results:
                value = outcome.values.get(comparison.column)
                if value is None or outcome.status != "ok" or not _in_group(row, group):
                    continue
                others = tuple((n, v) for n, v in row.factors if n != comparison.factor)
                own = row.value(comparison.factor)
                for side, name in zip(sides, (first, second), strict=True):
                    if own == name:
                        side[row.seed, others] = value
            keys = [key for key in sides[0] if key in sides[1]]
            if keys:
                pairs = [(sides[0][key], sides[1][key]) for key in keys]
                found.append(_compare(comparison.column, group, first, second, pairs))
    return found


def _groups(results: Results, within: Sequence[str]) -> list[tuple[tuple[str, str], ...]]:
    groups = (tuple((name, row.value(name)) for name in within) for row, _ in results)
    return list(dict.fromkeys(groups))


def _in_group(row: Row, group: Iterable[tuple[str, str]]) -> bool:
    return all(row.value(name) == value for name, value in group)


def _compare(
    column: str,
    group: tuple[tuple[str, str], ...],
    first: str,
    second: str,
    pairs: list[tuple[float, float]],
) -> Paired:
    differences = [a - b for a, b in pairs]
    mean = fmean(differences)
    low = high = p_t = p_wilcoxon = None
    if len(differences) > 1 and (spread := stdev(differences)) > 0.0:
        from scipy import stats

        error = spread / sqrt(len(differences))
        reach = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, len(differences) - 1)) * error
        low, high = mean - reach, mean + reach
        p_t = float(2.0 * stats.t.sf(abs(mean) / error, len(differences) - 1))
        p_wilcoxon = float(stats.wilcoxon(differences, zero_method="zsplit").pvalue)
    return Paired(
        column=column,
        within=group,
        first=first,
        second=second,
        pairs=len(pairs),
        first_mean=fmean(a for a, _ in pairs),
        second_mean=fmean(b for _, b in pairs),
        difference=mean,
        low=low,
        high=high,
        p_t=p_t,
        p_wilcoxon=p_wilcoxon,
        wins=sum(d > 0.0 for d in differences),
        ties=sum(d == 0.0 for d in differences),
    )


@dataclass(frozen=True, slots=True)
class Cell:
    """Mean, spread and range of one column at one point of the grid, over the runs that were ok."""

    factors: tuple[tuple[str, str], ...]
    column: str
    runs: int
    mean: float
    spread: float
    least: float
    most: float


def grid_cells(study: StudyFile, results: Results) -> list[Cell]:
    """Statistics of every column at every point of the grid that has results."""
    points: dict[tuple[tuple[str, str], ...], dict[str, list[float]]] = {}
    for row, outcome in results:
        if outcome.status != "ok":
            continue
        columns = points.setdefault(row.factors, {})
        for column in study.columns:
            value = outcome.values.get(column)
            if value is not None and isfinite(value):
                columns.setdefault(column, []).append(value)
    return [
        Cell(
            factors,
            column,
            len(found),
            fmean(found),
            stdev(found) if len(found) > 1 else 0.0,
            min(found),
            max(found),
        )
        for factors, columns in points.items()
        for column, found in columns.items()
    ]


def summary_lines(study: StudyFile, results: Results) -> list[str]:
    """The summary for people."""
    failed = [outcome for _, outcome in results if outcome.status != "ok"]
    lines = [f"{study.name}: {len(results)} of {study.row_count} runs, {len(failed)} failed"]
    lines += [f"  row {outcome.row}: {outcome.status}" for outcome in failed[:5]]
    compared = dict.fromkeys(c.column for c in study.comparisons)
    cells = grid_cells(study, results)
    for column in compared or study.columns:
        lines += ["", f"{column}: mean (standard deviation) least..most"]
        for cell in cells:
            if cell.column == column:
                numbers = f"{cell.mean:.4g} ({cell.spread:.2g}) {cell.least:.4g}..{cell.most:.4g}"
                lines.append(f"  {_named(cell.factors):<40} {numbers}   n={cell.runs}")
    for comparison in study.comparisons:
        lines += ["", f"{comparison.column}: differences at equal seeds, with 95 % confidence"]
        for pair in paired(results, comparison):
            lines.append(f"  {_named(pair.within):<28} {paired_text(pair)}")
    for column in study.watched:
        lines += ["", *watched_lines(column, results)]
    return lines


def watched_lines(column: str, results: Results) -> list[str]:
    """What became of a column that should stay 0: range, sum, and the rows where it did not, largest first."""
    found = [(outcome.row, outcome.values.get(column)) for _, outcome in results if outcome.status == "ok"]
    known = [(number, value) for number, value in found if value is not None]
    if not known:
        return [f"{column}: not measured in any run"]
    low, high = min(known, key=lambda f: (f[1], f[0])), max(known, key=lambda f: (f[1], -f[0]))
    hits = sorted((f for f in known if f[1] != 0.0), key=lambda f: (-f[1], f[0]))
    total = f"{sum(value for _, value in known):.10g} in all, " if low[1] == 0.0 else ""
    lines = [
        f"{column}: {total}not 0 in {len(hits)} of {len(known)} runs; "
        f"least {low[1]:.4g} (row {low[0]}), most {high[1]:.4g} (row {high[0]})"
    ]
    if 0 < len(hits) < len(known):
        rows = ", ".join(f"{number} ({value:.4g})" for number, value in hits[:WATCHED_ROWS])
        lines.append(
            f"  rows {rows}" + (f" and {len(hits) - WATCHED_ROWS} more" if len(hits) > WATCHED_ROWS else "")
        )
    return lines


def paired_text(pair: Paired) -> str:
    """One comparison in a line."""
    head = f"{pair.first} - {pair.second}: {pair.difference:+.4g}"
    if pair.low is not None and pair.high is not None:
        head += f" [{pair.low:+.4g}, {pair.high:+.4g}]  p_t={pair.p_t:.2g}  p_wilcoxon={pair.p_wilcoxon:.2g}"
    return f"{head}  higher in {pair.wins} of {pair.pairs}" + (f", equal in {pair.ties}" if pair.ties else "")


def _named(factors: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{name} {value}" for name, value in factors if value) or "all"
