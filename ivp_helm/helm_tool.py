"""``pymoos helm``: why the helm decides what it decides, from a log or from a running community."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ivp_helm.explain import Entry, Explanation


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from pymoos_lite.tools.client import add_client_arguments

    parser.add_argument(
        "log", nargs="?", metavar="LOG", help=".alog file or log folder; without it, a live helm"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--iter", type=int, metavar="N", help="the iteration of this number")
    which.add_argument(
        "--time", type=float, metavar="T", help="the iteration at or after T seconds of the log"
    )
    which.add_argument(
        "--changes", action="store_true", help="every iteration in which somebody's state changed"
    )
    which.add_argument("--follow", action="store_true", help="go on explaining a live helm until Ctrl-C")
    parser.add_argument("--plot", metavar="FILE", type=Path, help="draw functions and sum to an image file")
    add_client_arguments(parser)


def run(args: argparse.Namespace) -> int:
    return _from_log(args) if args.log else _from_community(args)


def _from_log(args: argparse.Namespace) -> int:
    from ivp_helm.explain import explanations
    from pymoos_lite.tools.log_reading import LogError

    try:
        chosen = list(_choose(explanations(_entries(args.log)), args))
    except LogError as error:
        print(error, file=sys.stderr)
        return 1
    if not chosen:
        print(f"{args.log}: {_what_is_missing(args)}", file=sys.stderr)
        return 1
    return _show(chosen, args.plot)


def _what_is_missing(args: argparse.Namespace) -> str:
    if args.iter is not None:
        return f"no helm iteration {args.iter} in this log"
    if args.time is not None:
        return f"no helm iteration at or after {args.time:g} s in this log"
    return "no helm iteration in this log (it holds no IVPHELM_SUMMARY)"


def _choose(found: Iterator[Explanation], args: argparse.Namespace) -> Iterator[Explanation]:
    if args.changes:
        yield from _changes(found)
        return
    last = None
    for explanation in found:
        last = explanation
        if explanation.iteration == args.iter or (args.time is not None and explanation.time >= args.time):
            yield explanation
            return
    if last is not None and args.iter is None and args.time is None:
        yield last


def _changes(found: Iterator[Explanation]) -> Iterator[Explanation]:
    former: object = None
    for explanation in found:
        states = ({part.name: part.state for part in explanation.parts}, explanation.reason)
        if states != former:
            former = states
            yield explanation


def _entries(log: str) -> Iterator[Entry]:
    from ivp_helm.explain import VARIABLES, Entry
    from pymoos_lite.records.alog import read_entries
    from pymoos_lite.tools.log_reading import read_log

    wanted = frozenset(VARIABLES)
    for entry in read_entries(read_log(log)):
        if entry.name in wanted:
            yield Entry(entry.time, entry.name, entry.value)


def _from_community(args: argparse.Namespace) -> int:
    from ivp_helm.explain import VARIABLES, Entry, History
    from pymoos_lite.hosts.mission import MissionError
    from pymoos_lite.tools.client import UnreachableError, connect

    try:
        client = connect(args, "pymoos_helm")
    except (UnreachableError, MissionError) as error:
        print(error, file=sys.stderr)
        return 1
    try:
        for name in VARIABLES:
            client.register(name)
        client.register("IVPHELM_REJOURNAL")
        client.notify("IVPHELM_REJOURNAL", "true")  # the next summary is then a complete one
        client.notify("HELM_MAP_CLEAR", "pymoos_helm")  # and statuses are posted again
        history = History()
        end = client.clock.wall() + args.timeout
        complete = False
        while client.clock.wall() < end or args.follow:
            for message in client.poll(0.1):
                finished = history.take(Entry(message.time, message.name, str(message.value)))
                complete = complete or "ivpdomain" in history.summary.values
                if finished is not None and complete:
                    _show([finished], args.plot)
                    if not args.follow:
                        return 0
        print(
            "no helm iterates in this community (is it parked? then there is nothing to explain)",
            file=sys.stderr,
        )
        return 1
    finally:
        client.close()


def _show(chosen: list[Explanation], plot: Path | None) -> int:
    for k, explanation in enumerate(chosen):
        if k:
            print()
        print("\n".join(explanation.lines()))
    if plot is None:
        return 0
    from ivp_helm.explain_plot import plot_explanation

    try:
        plot_explanation(chosen[-1], plot)
    except ValueError as error:
        print(f"{error}; functions are logged as BHV_IPF (pHelmIvP: bhv_ipf = always)", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{plot}: cannot be written ({error})", file=sys.stderr)
        return 1
    print(f"drawn to {plot}")
    return 0
