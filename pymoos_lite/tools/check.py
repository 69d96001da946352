"""``pymoos check MISSION``: everything that is wrong with a mission, at once, without running it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pymoos_lite.hosts.plan import CommunityPlan
from pymoos_lite.tools.mission import (
    MissionError,
    add_mission_arguments,
    deeper_problems,
    load_plan,
    parse_macros,
    parse_settings,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_mission_arguments(parser)


def run(args: argparse.Namespace) -> int:
    from pymoos_lite.hosts.fleet import is_fleet

    if is_fleet(args.mission):
        return _check_fleet(args)
    try:
        plan = load_plan(args.mission, parse_settings(args.set))
    except MissionError as error:
        print(error, file=sys.stderr)
        return 1
    problems = [*plan.problems, *deeper_problems(plan)]
    for problem in problems:
        print(problem)
    print(explanations(plan), end="")
    bad = [p for p in problems if args.strict or p.severity == "error"]
    apps = ", ".join(plan.app_names) or "no apps"
    warnings = len(problems) - len([p for p in problems if p.severity == "error"])
    print(f"{plan.mission.file}: {len(problems) - warnings} errors, {warnings} warnings; would run {apps}")
    return 1 if bad else 0


def _check_fleet(args: argparse.Namespace) -> int:
    import tempfile

    from pymoos_lite.hosts.fleet import find_fleet, load_fleet, plan_fleet

    with tempfile.TemporaryDirectory(prefix="pymoos_check_") as out:
        try:
            path = find_fleet(args.mission)
            macros = parse_macros(args.macro)
            fleet = load_fleet(path, args.vehicles, None, args.preset, macros)
            plan = plan_fleet(fleet, path.resolve().parent, Path(out), settings=parse_settings(args.set))
        except MissionError as error:
            print(error, file=sys.stderr)
            return 1
        problems = [*plan.problems, *deeper_problems(*(member.plan for member in plan.members))]
        explained = explanations(*(member.plan for member in plan.members))
    for problem in problems:
        print(problem)
    print(explained, end="")
    errors = len([p for p in problems if p.severity == "error"])
    names = ", ".join(member.name for member in plan.members) or "nothing"
    print(f"{fleet.file}: {errors} errors, {len(problems) - errors} warnings; would run {names}")
    return 1 if errors or (args.strict and problems) else 0


def explanations(*plans: CommunityPlan) -> str:
    """What apps say of themselves; said once by all who would say the same."""
    said: dict[tuple[str, str], list[str]] = {}
    for plan in plans:
        blocks = {app.program.lower(): app.lines for app in plan.apps}
        for app in plan.apps:
            text = app.cls.explain_block(app.lines, plan.mission_dir, blocks)
            if text:
                said.setdefault((app.name, text), []).append(plan.community)
    return "".join(f"{name} of {', '.join(who)}\n\n{text}\n\n" for (name, text), who in said.items())
