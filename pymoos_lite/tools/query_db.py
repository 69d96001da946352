"""`uQueryDB MISSION.moos --condition=C`: waits until conditions hold in a running community (community.md 15).

Exit status 0 when all pass conditions hold and no fail condition does, 1 when it took too long or the community
is gone.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pymoos_lite.config.conditions import Condition, ConditionError, parse_condition
from pymoos_lite.config.mission import MissionFile, read_number
from pymoos_lite.config.problems import ConfigurationError
from pymoos_lite.core.message import Value
from pymoos_lite.hosts.mission import MissionError, find_mission, read_mission
from pymoos_lite.records.csp import num
from pymoos_lite.tools.client import UnreachableError, add_client_arguments, connect

LOST_AFTER = 5.0
CHECK_FILE = ".checkvars"
FORMATS = {"esv": " {}={}", "csv": "{},{}", "wsv": "{} {}", "vo": "{1}"}
_PASS_KEYS = ("condition", "pass_condition")


@dataclass(frozen=True, slots=True)
class Query:
    """What is waited for, how long (mission seconds, 0 for ever), and what is written down at the end."""

    passes: tuple[Condition, ...] = ()
    fails: tuple[Condition, ...] = ()
    wait: float = 0.0
    check: tuple[str, ...] = ()
    form: str = "esv"

    def holds(self, known: Mapping[str, Value]) -> bool:
        """All pass conditions and no fail condition; true when there are none."""
        return all(c.holds(known.get) for c in self.passes) and not any(
            c.holds(known.get) for c in self.fails
        )

    def names(self) -> list[str]:
        names = [n for c in (*self.passes, *self.fails) for n in c.registrations()]
        return list(dict.fromkeys([*names, *self.check]))

    def check_lines(self, known: Mapping[str, Value]) -> list[str]:
        """One line per check variable that has a value."""
        form = FORMATS[self.form]
        return [form.format(name, _shown(known[name])) for name in self.check if name in known]


def _shown(value: Value) -> str:
    if isinstance(value, float):
        return num(value, 6)
    return value if isinstance(value, str) else f"*binary* {len(value)} B"


def query_of(mission: MissionFile, args: argparse.Namespace) -> Query:
    """The mission's uQueryDB block and the command line together.

    Raises ConditionError and ConfigurationError.
    """
    block = mission.block("uQueryDB")
    lines = block.lines if block is not None else ()
    passes, fails, check = list(args.passes), list(args.fails), list(args.check)
    wait, form = args.wait, args.form
    for line in lines:
        if line.name in _PASS_KEYS:
            passes.append(line.value)
        elif line.name == "fail_condition":
            fails.append(line.value)
        elif line.name == "check_var":
            check += [name.strip() for name in line.value.split(",")]
        elif line.name == "check_var_format" and form is None:
            form = line.value.strip().lower()
        elif line.name in ("wait", "halt_max_time") and wait is None:
            wait = read_number(line, mission.file)
    return Query(
        _parsed(passes), _parsed(fails), wait or 0.0, tuple(check), form if form in FORMATS else "esv"
    )


def _parsed(texts: Iterable[str]) -> tuple[Condition, ...]:
    return tuple(parse_condition(text) for text in texts)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run uQueryDB; returns the exit status."""
    parser = argparse.ArgumentParser(prog="uQueryDB", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("file", nargs="?", metavar="MISSION.moos", help="says where the community is")
    for names, target, words in (
        (("--condition", "--pass_condition"), "passes", "must hold (repeatable)"),
        (("--fail_condition",), "fails", "must not hold (repeatable)"),
        (("--check_var",), "check", f"write its value to {CHECK_FILE} at the end (repeatable)"),
    ):
        parser.add_argument(*names, dest=target, action="append", default=[], metavar="X", help=words)
    parser.add_argument("--wait", type=float, metavar="N", help="mission seconds to wait at most; 0 for ever")
    for form in FORMATS:
        parser.add_argument(
            f"--{form}", dest="form", action="store_const", const=form, help=f"{CHECK_FILE} as {form}"
        )
    parser.add_argument("--unique", action="store_true", help="accepted: the client's name always is")
    add_client_arguments(parser)
    args = parser.parse_args(arguments)
    args.mission = args.file or args.mission
    try:
        mission = read_mission(find_mission(args.mission), {}) if args.mission else MissionFile("")
        return ask(args, query_of(mission, args))
    except (UnreachableError, MissionError, ConditionError, ConfigurationError, OSError) as refusal:
        print(f"uQueryDB: {refusal}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def ask(args: argparse.Namespace, query: Query) -> int:
    """Connect, wait, write the check variables. Raises UnreachableError, OSError."""
    client = connect(args, "uQueryDB")
    known: dict[str, Value] = {}
    try:
        for name in query.names():
            client.register(name)
        began, seen = client.clock.now(), client.clock.wall()
        status = None
        while status is None:
            for message in client.poll(0.1):
                known[message.name] = message.value
            if query.holds(known):
                status = 0
            elif query.wait and client.clock.now() - began > query.wait:
                status = 1
            if client.connected:
                seen = client.clock.wall()
            elif client.clock.wall() - seen > LOST_AFTER:
                raise UnreachableError("the community is gone")
        # Variables that no condition needs may still be on their way.
        end = client.clock.wall() + 0.5
        while any(name not in known for name in query.check) and client.clock.wall() < end:
            for message in client.poll(0.05):
                known[message.name] = message.value
    finally:
        client.close(0.0)
    if query.check:
        Path(CHECK_FILE).write_text(
            "".join(f"{line}\n" for line in query.check_lines(known)), encoding="utf-8"
        )
    return status


if __name__ == "__main__":
    raise SystemExit(main())
