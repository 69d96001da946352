"""What a run of a population leaves behind, and how it tells how far it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from opinion_engine.model import Floats

Progress = Callable[[int, int], None]
"""Called with (steps done, steps)."""


class PopulationResult(NamedTuple):
    """What `Population.run` recorded: t (R,), z (R, n, N_O) and u (R, n) of the agents observed, and for all
    agents
    the share whose strongest option is each (R, N_O), the mean attention (R,) and the mean degree heard
    (R,)."""

    t: Floats
    z: Floats
    u: Floats
    shares: Floats
    mean_attention: Floats
    mean_heard: Floats

    @classmethod
    def empty(cls, records: int, observed: int, n_options: int) -> PopulationResult:
        """Room for `records` records of `observed` agents."""
        return cls(
            np.empty(records),
            np.empty((records, observed, n_options)),
            np.empty((records, observed)),
            np.empty((records, n_options)),
            np.empty(records),
            np.empty(records),
        )


class ProgressBar:
    """A context that yields the function to call with the number of steps done."""

    def __init__(self, wanted: bool | Progress, total: int) -> None:
        self._wanted, self._total = wanted, total

    def __enter__(self) -> Callable[[int], None]:
        wanted, total = self._wanted, self._total
        if callable(wanted):
            return lambda done: wanted(done, total)
        self._bar = None
        if not wanted:
            return lambda done: None
        from rich.progress import Progress as Bar

        bar = self._bar = Bar(transient=True)
        bar.start()
        task = bar.add_task("population", total=total)
        return lambda done: bar.update(task, completed=done)

    def __exit__(self, *exc: object) -> None:
        bar = getattr(self, "_bar", None)
        if bar is not None:
            bar.stop()
