"""`pymoos log COMMAND ...`: what a person does with log files, under the names of the stock alog tools."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from pymoos_lite.tools.log_plot import add_plot, run_plot
from pymoos_lite.tools.log_reading import LogError
from pymoos_lite.tools.log_scan import add_scan, run_scan
from pymoos_lite.tools.log_select import (
    add_clip,
    add_grep,
    add_rm,
    add_sort,
    run_clip,
    run_grep,
    run_rm,
    run_sort,
)

Add = Callable[[argparse.ArgumentParser], None]
Run = Callable[[argparse.Namespace], int]

COMMANDS: dict[str, tuple[str, Add, Run]] = {
    "grep": ("keep entries of some variables or apps (aloggrep)", add_grep, run_grep),
    "scan": ("list variables, their sources and sizes (alogscan)", add_scan, run_scan),
    "plot": ("draw tracks and variables to a PNG", add_plot, run_plot),
    "clip": ("keep a span of time (alogclip)", add_clip, run_clip),
    "rm": ("leave out variables or apps (alogrm)", add_rm, run_rm),
    "sort": ("sort by time (alogsort)", add_sort, run_sort),
}


class IntermixedParser(argparse.ArgumentParser):
    """Takes options between file names and variables too, as the stock tools do."""

    _inside = False

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        if self._inside:  # the intermixed parser calls this method in turn
            return super().parse_known_args(args, namespace)
        self._inside = True
        try:
            return super().parse_known_intermixed_args(args, namespace)
        finally:
            self._inside = False


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One sub-parser per command."""
    commands: Any = parser.add_subparsers(
        dest="command", metavar="COMMAND", required=True, parser_class=IntermixedParser
    )
    for name, (summary, add, _) in COMMANDS.items():
        add(commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}."))


def run(args: argparse.Namespace) -> int:
    """Run the chosen command; 1 with one line on stderr if a log cannot be used."""
    try:
        return COMMANDS[args.command][2](args)
    except LogError as refusal:
        print(f"pymoos log {args.command}: {refusal}", file=sys.stderr)
        return 1
