"""``pymoos compile``: the hot modules as machine code, or plain Python again."""

from __future__ import annotations

import argparse
import importlib.util
import sys

from pymoos_lite import compiled
from pymoos_lite.compiled import build


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``pymoos compile``."""
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument(
        "--state", action="store_true", help="only say what runs now: compiled or plain, and why"
    )
    choice.add_argument(
        "--remove", action="store_true", help="remove what was compiled: plain Python runs again"
    )


def run(args: argparse.Namespace) -> int:
    """Compile, remove or tell; returns the exit status."""
    if args.state:
        print(compiled.state())
        return 0
    if args.remove:
        compiled.remove(compiled.FOLDER)
        print("plain Python runs from now on")
        return 0
    missing = [name for name in ("mypyc", "setuptools") if importlib.util.find_spec(name) is None]
    if missing:
        print(
            f"pymoos compile: {' and '.join(missing)} is not installed: pip install 'pymoos-lite[compile]'",
            file=sys.stderr,
        )
        return 1
    print("compiling the hot modules (a minute or two) ...", flush=True)
    trouble = build.build_apart(compiled.FOLDER)
    if trouble:
        print(f"pymoos compile: {trouble}", file=sys.stderr)
        return 1
    print(f"compiled: {compiled.FOLDER}")
    return 0
