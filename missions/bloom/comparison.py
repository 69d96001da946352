"""Runs beside each other: whether vessels commit to an option, or waver between explore and exploit.

What section 11 of the mission's facts asks of alpha is answered with this: opinions on the simplex, how often
each difference between the two opinions occurs, and a few numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from missions.bloom.run_log import RunLog
from opinion_engine.model import OpinionError
from opinion_engine.plots import QUIET, SIMULATED, figure, simplex_panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEADLOCK = 0.5
"""Opinions of explore and exploit closer than this are a deadlock: about a tenth of a commitment."""
ZOOM = -4.0
BINS = np.linspace(-8.0, 8.0, 81)


@dataclass(frozen=True)
class Commitment:
    """How decided the vessels of a run were, over all of them and the time looked at.

    changes   option changes of a vessel in ten minutes
    strength  mean norm of an opinion
    apart     mean of |z_exploit - z_explore|
    deadlock  share of the time with less than `DEADLOCK` between the two
    samples   samples taken by all vessels together
    """

    changes: float
    strength: float
    apart: float
    deadlock: float
    samples: int


def commitment(run: RunLog, begin: float) -> Commitment:
    """The numbers of a run from `begin` seconds on.

    Raises:
        OpinionError: the run is over by then, or has no options explore and exploit.
    """
    z, apart = run.opinions.z[run.index(begin) :], difference(run, begin)
    option = run.option[run.index(begin) :]
    both = (option[1:] >= 0) & (option[:-1] >= 0)  # out of action is no change of mind
    changes = np.count_nonzero((option[1:] != option[:-1]) & both)
    vessel_time = (len(option) - 1) * option.shape[1] * float(run.t[1] - run.t[0])
    return Commitment(
        changes=600.0 * changes / vessel_time,
        strength=float(np.linalg.norm(z, axis=2).mean()),
        apart=float(np.abs(apart).mean()),
        deadlock=float((np.abs(apart) < DEADLOCK).mean()),
        samples=int((run.samples[-1] - run.samples[run.index(begin)]).sum()),
    )


def difference(run: RunLog, begin: float) -> NDArray[np.float64]:
    """(T, N) opinion of exploit minus that of explore, from `begin` seconds on.

    Raises:
        OpinionError: as for `commitment`.
    """
    options = run.opinions.options
    if not {"explore", "exploit"} <= set(options):
        raise OpinionError(f"options explore and exploit are wanted, the run has {', '.join(options)}")
    first = run.index(begin)
    if run.t.size - first < 2:
        raise OpinionError(f"the run ends at {run.t[-1]:.0f} s, before {begin:.0f} s")
    z = run.opinions.z[first:]
    found: NDArray[np.float64] = z[..., options.index("exploit")] - z[..., options.index("explore")]
    return found


def commitment_lines(names: Sequence[str], runs: Sequence[RunLog], begin: float) -> list[str]:
    """A table for people, one line for each run."""
    width = max(3, *(len(name) for name in names))
    lines = [f"{'run':<{width}}  changes/10 min  |opinion|  apart  deadlock  samples"]
    for name, run in zip(names, runs, strict=True):
        c = commitment(run, begin)
        lines.append(
            f"{name:<{width}}  {c.changes:>14.1f}  {c.strength:>9.2f}  {c.apart:>5.2f}  {c.deadlock:>7.1%}  "
            f"{c.samples:>7}"
        )
    return lines


def compare_figure(names: Sequence[str], runs: Sequence[RunLog], begin: float) -> Figure:
    """A column for each run: opinions on the simplex, and how often each difference of the two occurs.

    Raises:
        OpinionError: as for `commitment`.
        ValueError: there is no run.
    """
    if not runs:
        raise ValueError("a comparison needs at least one run")
    made, axes = figure(
        4.0 * len(runs), 5.2, 2, len(runs), squeeze=False, height_ratios=[2.4, 1.0], sharey="row"
    )
    for column, (name, run) in enumerate(zip(names, runs, strict=True)):
        o = run.opinions
        above, below = axes[0][column], axes[1][column]
        apart = difference(run, begin)
        simplex_panel(above, o.z[run.index(begin) :], o.names, o.options, ZOOM)
        above.set_title(name, fontsize=10)
        kept = np.clip(apart, BINS[0], BINS[-1]).ravel()
        below.hist(kept, BINS, weights=np.full(kept.size, 100.0 / kept.size), color=SIMULATED)
        below.axvline(0.0, color=QUIET, linewidth=0.8, linestyle=":")
        below.set_xlabel("exploit minus explore", fontsize=9)
    axes[1][0].set_ylabel("% of the time", fontsize=9)
    return made
