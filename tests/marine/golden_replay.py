"""Replays a recorded run step by step.

When exactly an input reached the recorded application is not in the log (0 to 0.06 s after its stamp).
So each input may take effect at the first, second or third step from its stamp on, whichever explains
the seconds after it best.
"""

from __future__ import annotations

import copy
import csv
import json
from bisect import bisect_left
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Protocol

DATA = Path(__file__).parent.parent / "data" / "sim"
_HORIZON = 20  # steps that judge one choice


class System(Protocol):
    def receive(self, variable: str, text: str, now: float) -> None: ...
    def step(self, now: float) -> None: ...
    def misfit(self, row: dict[str, float]) -> float: ...


@dataclass
class Recording:
    rows: list[dict[str, float]]
    inputs: list[tuple[float, str, str]]
    config: dict[str, str]
    step_times: list[float] = field(default_factory=list)
    row_at: dict[int, dict[str, float]] = field(default_factory=dict)


def load(name: str, steps_per_row: int) -> Recording:
    config = json.loads((DATA / "scenarios.json").read_text())[name]["config"]
    with open(DATA / f"{name}.csv", newline="") as file:
        rows = [{k: float(v) for k, v in row.items() if v} for row in csv.DictReader(file)]
    with open(DATA / f"{name}.inputs.csv", newline="") as file:
        inputs = [(float(row["t"]), row["var"], row["value"]) for row in csv.DictReader(file)]
    pairs = dict(line.split(" = ", 1) for line in config)
    recording = Recording(rows, inputs, pairs)
    for before, row in pairwise(rows):
        gap = (row["t"] - before["t"]) / steps_per_row
        recording.step_times += [before["t"] + gap * (i + 1) for i in range(steps_per_row)]
        recording.row_at[len(recording.step_times) - 1] = row
    return recording


def replay(
    system: Any, recording: Recording, variables: frozenset[str]
) -> list[tuple[Any, dict[str, float]]]:
    """(state of the system, recorded row) for every row, with every input at its best-fitting step."""
    times = recording.step_times
    events: list[tuple[float, list[tuple[str, str]]]] = []
    for stamp, variable, text in recording.inputs:
        if variable in variables:
            if events and stamp - events[-1][0] < 0.005:  # posted together, heard together
                events[-1][1].append((variable, text))
            else:
                events.append((stamp, [(variable, text)]))
    pairs: list[tuple[Any, dict[str, float]]] = []
    done = 0

    def run(target: Any, first: int, last: int) -> float:
        misfit = 0.0
        for index in range(first, min(last, len(times))):
            target.step(times[index])
            if index in recording.row_at:
                misfit += target.misfit(recording.row_at[index])
        return misfit

    def run_and_keep(last: int) -> None:
        nonlocal done
        for index in range(done, min(last, len(times))):
            system.step(times[index])
            if index in recording.row_at:
                pairs.append((copy.deepcopy(system), recording.row_at[index]))
        done = max(done, min(last, len(times)))

    for number, (stamp, posts) in enumerate(events):
        first = max(done, bisect_left(times, stamp))
        following = bisect_left(times, events[number + 1][0]) if number + 1 < len(events) else len(times)
        best = first
        least = float("inf")
        for effect in range(first, first + 3):
            trial = copy.deepcopy(system)
            misfit = run(trial, done, effect)
            for variable, text in posts:
                trial.receive(variable, text, stamp)
            misfit += run(trial, effect, max(first + 3, min(following, first + _HORIZON)))
            if misfit < least:
                best, least = effect, misfit
        run_and_keep(best)
        for variable, text in posts:
            system.receive(variable, text, stamp)
    run_and_keep(len(times))
    return pairs
