"""What the commands that take a mission share: their arguments and how they tell its problems."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable

from pymoos_lite.config.conditions import ConditionError, parse_condition
from pymoos_lite.config.problems import Problem
from pymoos_lite.core.message import Value
from pymoos_lite.hosts.mission import MissionError, load_plan, parse_settings, shipped_missions
from pymoos_lite.hosts.plan import CommunityPlan

__all__ = [
    "Lookup",
    "MissionError",
    "add_mission_arguments",
    "end_condition",
    "load_plan",
    "parse_settings",
    "report_problems",
    "shipped_missions",
]

Lookup = Callable[[str], Value | None]


def end_condition(plan: CommunityPlan, text: str | None) -> Callable[[Lookup], bool] | None:
    """When the mission is over: `text`, or the mission file's own ``EndWhen = CONDITION`` line.

    Raises:
        MissionError: the condition cannot be read.
    """
    where = "--until"
    if text is None:
        line = plan.mission.find_global("EndWhen")
        if line is None:
            return None
        text, where = line.value, f"{plan.mission.file}:{line.line}: EndWhen"
    try:
        condition = parse_condition(text)
    except ConditionError as error:
        raise MissionError(f"{where}: {error}") from None

    def holds(get: Lookup) -> bool:
        def known(name: str) -> float | str | None:
            value = get(name)
            return None if isinstance(value, bytes) else value

        return condition.holds(known)

    return holds


def add_mission_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments that `launch`, `sim` and `check` share."""
    parser.add_argument(
        "mission", metavar="MISSION", help="a .moos file, a folder, or the name of a shipped mission"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="replace the value of a line; APP.NAME=VALUE touches one block only (repeatable)",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="refuse a mission with an unknown app or parameter instead of warning",
    )


def report_problems(problems: Iterable[Problem], strict: bool) -> bool:
    """Print problems to stderr; True if the mission must not run."""
    refused = False
    for problem in problems:
        print(problem, file=sys.stderr)
        refused = refused or strict or problem.severity == "error"
    return refused
