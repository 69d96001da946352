"""What the commands that take a mission share: their arguments and how they tell its problems."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping

from pymoos_lite.config.conditions import Condition, ConditionError, parse_condition
from pymoos_lite.config.problems import Problem
from pymoos_lite.core.message import Value
from pymoos_lite.hosts.mission import MissionError, load_plan, parse_settings, shipped_missions
from pymoos_lite.hosts.plan import CommunityPlan

__all__ = [
    "EndCondition",
    "MissionError",
    "add_mission_arguments",
    "deeper_problems",
    "end_condition",
    "load_plan",
    "parse_macros",
    "parse_settings",
    "report_problems",
    "shipped_missions",
]


def parse_macros(texts: Iterable[str]) -> dict[str, str]:
    """``NAME=VALUE`` texts of ``--macro`` as a dictionary.

    Raises:
        MissionError: one has no ``=`` or no name.
    """
    macros = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise MissionError(f"--macro {text}: expected NAME=VALUE")
        macros[name.strip()] = value.strip()
    return macros


class EndCondition:
    """When a mission is over, judged by the last values of the variables it names."""

    def __init__(self, condition: Condition) -> None:
        self._condition = condition
        self.variables = condition.variables()

    def __str__(self) -> str:
        return str(self._condition)

    def holds(self, values: Mapping[str, Value]) -> bool:
        """Whether the mission is over, given the last value of each variable."""

        def known(name: str) -> float | str | None:
            value = values.get(name)
            return None if isinstance(value, bytes) else value

        return self._condition.holds(known)


def end_condition(plan: CommunityPlan, text: str | None) -> EndCondition | None:
    """The end of a mission: `text`, or the mission file's own ``EndWhen = CONDITION`` line.

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
        return EndCondition(parse_condition(text))
    except ConditionError as error:
        raise MissionError(f"{where}: {error}") from None


def add_mission_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments that `launch`, `sim` and `check` share."""
    parser.add_argument(
        "mission",
        metavar="MISSION",
        help="a .moos file, a fleet's .yaml file, a folder, or the name of a shipped mission",
    )
    parser.add_argument(
        "--vehicles", type=int, metavar="N", help="how many vehicles (fleets only; default: as the file says)"
    )
    parser.add_argument(
        "--preset",
        action="append",
        default=[],
        metavar="NAME",
        help="a preset of the fleet file (repeatable: the later ones win)",
    )
    parser.add_argument(
        "--macro",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a macro for every template of a fleet (repeatable)",
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


def deeper_problems(*plans: CommunityPlan) -> list[Problem]:
    """What apps find wrong with the files they name (a helm with its `.bhv` file)."""
    found: list[Problem] = []
    for plan in plans:
        for app in plan.apps:
            found += app.cls.check_block(app.lines, plan.mission_dir, plan.mission.file)
    return found


def report_problems(problems: Iterable[Problem], strict: bool) -> bool:
    """Print problems to stderr; True if the mission must not run."""
    refused = False
    for problem in problems:
        print(problem, file=sys.stderr)
        refused = refused or strict or problem.severity == "error"
    return refused
