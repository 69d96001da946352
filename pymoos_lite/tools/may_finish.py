"""`uMayFinish MISSION.moos --max_time=N`: waits for the end of a mission, for scripts (community.md 17).

Exit status 0 when the mission has been evaluated, 1 when it took too long or the community is gone.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from pymoos_lite.config.mission import MissionFile, read_number
from pymoos_lite.config.problems import ConfigurationError
from pymoos_lite.core.message import Value
from pymoos_lite.hosts.mission import MissionError, find_mission, read_mission
from pymoos_lite.tools.client import UnreachableError, add_client_arguments, connect

LOST_AFTER = 5.0
"""Wall seconds without connection after which the community counts as gone."""


@dataclass(frozen=True, slots=True)
class FinishRule:
    """When a mission is over: `variable` has the text `value`, or the database is older than `max_uptime`."""

    variable: str = "MISSION_EVALUATED"
    value: str = "true"
    max_uptime: float = float("inf")

    def verdict(self, name: str, value: Value) -> int | None:
        """Exit status that a post settles, None if it settles nothing."""
        if name == "DB_UPTIME" and isinstance(value, float) and value > self.max_uptime:
            return 1
        if name == self.variable and _shown(value) == self.value:
            return 0
        return None


def _shown(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def rule_of(mission: MissionFile, max_time: float | None) -> FinishRule:
    """The rule of the mission's uMayFinish block; `max_time` of the command line goes first.

    Raises ConfigurationError for a time that is no number.
    """
    block = mission.block("uMayFinish")
    variable, value, limit = FinishRule().variable, FinishRule().value, float("inf")
    if block is not None:
        if (line := block.last("finish_var")) is not None:
            variable = line.value.strip('"')
        if (line := block.last("finish_val")) is not None:
            value = line.value.strip('"')
        if (line := block.last("max_db_uptime") or block.last("max_time")) is not None:
            limit = read_number(line, mission.file)
    return FinishRule(variable, value, limit if max_time is None else max_time)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run uMayFinish; returns the exit status (2 for a command line that cannot be followed)."""
    parser = argparse.ArgumentParser(prog="uMayFinish", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("file", nargs="?", metavar="MISSION.moos", help="says where the community is")
    parser.add_argument(
        "--max_time", "--max-time", type=float, metavar="N", help="mission seconds to wait at most"
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="say nothing at the end")
    add_client_arguments(parser)
    args = parser.parse_args(arguments)
    args.mission = args.file or args.mission
    try:
        mission = read_mission(find_mission(args.mission), {}) if args.mission else MissionFile("")
        rule = rule_of(mission, args.max_time)
        text, status = wait(args, rule)
    except (UnreachableError, MissionError, ConfigurationError) as refusal:
        print(f"uMayFinish: {refusal}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    if not args.quiet:
        print(text)
    return status


def wait(args: argparse.Namespace, rule: FinishRule) -> tuple[str, int]:
    """Connect and wait for a verdict; a sentence for the user, and the exit status. Raises UnreachableError."""
    client = connect(args, "uMayFinish")
    try:
        client.register(rule.variable)
        client.register("DB_UPTIME")
        seen = client.clock.wall()
        while True:
            for message in client.poll(0.1):
                status = rule.verdict(message.name, message.value)
                if status is not None:
                    how = "finished" if status == 0 else f"not finished after {rule.max_uptime:g} s"
                    return f"{how}: {message.name} = {_shown(message.value)}", status
            if client.connected:
                seen = client.clock.wall()
            elif client.clock.wall() - seen > LOST_AFTER:
                raise UnreachableError("the community is gone")
    finally:
        client.close(0.0)


if __name__ == "__main__":
    raise SystemExit(main())
