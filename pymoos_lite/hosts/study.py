"""One run of a study, from its row to its numbers: what a worker does, wherever it works.

A run depends on the study file, the mission and the row alone, so that equal rows give equal numbers in any
process, in any order.
"""

from __future__ import annotations

import gc
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymoos_lite.config.study_file import Measure, Row, StudyFile, is_macro, parse_study
from pymoos_lite.core.message import Value
from pymoos_lite.hosts.failures import describe_failure
from pymoos_lite.hosts.fleet import (
    FleetPlan,
    add_fleet,
    deploy_in_lockstep,
    find_fleet,
    load_fleet,
    plan_fleet,
)
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.mission import MissionError

DEFAULT_DURATION = 600.0


@dataclass(frozen=True)
class Outcome:
    """What a run came to. `status` is ``ok`` or says what went wrong; `wall` is the seconds it took.

    `values` has every column of the study, None where nothing was posted.
    """

    row: int
    status: str
    values: Mapping[str, float | None]
    wall: float = 0.0

    def to_json(self) -> dict[str, Any]:
        return {
            "row": self.row,
            "status": self.status,
            "values": dict(self.values),
            "wall": round(self.wall, 3),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Outcome:
        """Raises KeyError, TypeError or ValueError for anything that `to_json` did not make."""
        values = {str(k): None if v is None else float(v) for k, v in data["values"].items()}
        return cls(int(data["row"]), str(data["status"]), values, float(data.get("wall", 0.0)))


def plan_row(
    study: StudyFile, row: Row, out: Path, macros: Mapping[str, str] | None = None
) -> tuple[FleetPlan, float]:
    """The fleet of a row, its templates expanded into `out`, and its duration in mission seconds.

    `macros` are added to those of the study and of the row.

    Raises:
        MissionError: the mission cannot be found, or is faulty.
    """
    path = find_fleet(_mission_of(study))
    factors = dict(row.factors)
    vehicles = int(factors.pop("vehicles")) if "vehicles" in factors else None
    presets = [*study.presets, *(value for name, value in factors.items() if not is_macro(name))]
    own = {name: value for name, value in factors.items() if is_macro(name)}
    fleet = load_fleet(path, vehicles, row.seed, presets, {**study.macros, **own, **(macros or {})})
    plan = plan_fleet(fleet, path.resolve().parent, out, warp=1.0)
    if plan.errors:
        raise MissionError(str(plan.errors[0]))
    return plan, study.duration or fleet.duration or DEFAULT_DURATION


def _mission_of(study: StudyFile) -> str:
    """The mission as named: relative to the study file if it is there."""
    beside = Path(study.file).resolve().parent / study.mission
    return str(beside) if beside.exists() else study.mission


def run_row(study: StudyFile, row: Row, log_dir: Path | None = None) -> Outcome:
    """Run one row to its end. With `log_dir`, its `row_macros` count and loggers write there.

    Never raises, whatever the mission, an app, or the measuring does: the outcome's status says so, and the
    other rows of the study go on.
    """
    began = time.perf_counter()
    empty: dict[str, float | None] = dict.fromkeys(study.columns)
    with tempfile.TemporaryDirectory(prefix="pymoos_study_") as scratch:
        out = log_dir or Path(scratch)
        try:
            plan, duration = plan_row(study, row, out, study.row_macros if log_dir is not None else None)
            host = Lockstep(row.seed, out, stagger=True)
            add_fleet(host, plan)
            deploy_in_lockstep(host, plan)
            host.run(duration)
            values = measured(study, host, plan, row)
            host.stop()
        except (MissionError, ValueError) as error:
            return Outcome(row.number, _failed(str(error)), empty, time.perf_counter() - began)
        except Exception as error:  # a fault of ours or of the mission's code: where it is must be told
            failure = describe_failure(f"row {row.number}", "the run", error, "host")
            return Outcome(
                row.number, _failed(f"{failure.text} [{failure.where}]"), empty, time.perf_counter() - began
            )
    status = _failed(str(host.failures[0])) if host.failures else "ok"
    took = time.perf_counter() - began
    del host, plan
    if took > 1.0:
        gc.collect()  # communities hold each other in circles: let one run's go before the next begins
    return Outcome(row.number, status, values, took)


def _failed(text: str) -> str:
    return f"failed: {text}".splitlines()[0]


def run_text(text: str, file: str, number: int) -> dict[str, Any]:
    """`run_row` for a study given as its text: what is sent to workers in other processes."""
    study = parse_study(text, file)
    return run_row(study, study.row(number)).to_json()


def measured(study: StudyFile, host: Lockstep, plan: FleetPlan, row: Row) -> dict[str, float | None]:
    """Every column of the study, as the communities stand now."""
    values: dict[str, float | None] = {m.column: _measure(m, host, plan) for m in study.measures}
    known = {**values, "vehicles": float(len(plan.fleet.vehicles)), "seed": float(row.seed)}
    for name, formula in study.derived:
        values[name] = known[name] = formula.value(known)
    return values


def _measure(measure: Measure, host: Lockstep, plan: FleetPlan) -> float | None:
    if measure.place == "network":
        return float(getattr(host.network.total(), _TRAFFIC.get(measure.variable, measure.variable)))
    if measure.place in ("sum", "mean", "min", "max"):
        found = [_number(host, name, measure) for name in plan.fleet.vehicle_names()]
        numbers = [number for number in found if number is not None]
        if not numbers:
            return None
        if measure.place == "min":
            return min(numbers)
        if measure.place == "max":
            return max(numbers)
        total = sum(numbers)
        return total / len(numbers) if measure.place == "mean" else total
    return _number(host, measure.place, measure)


_TRAFFIC = {"datagrams": "sent"}


def _number(host: Lockstep, community: str, measure: Measure) -> float | None:
    home = host.communities.get(community)
    value: Value | None = None if home is None else home.database.value(measure.variable)
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return {"true": 1.0, "false": 0.0}.get(value.strip().lower(), measure.default)
    return value if isinstance(value, float) else measure.default
