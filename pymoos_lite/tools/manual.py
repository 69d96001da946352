"""``pymoos help NAME``: the parameters of an app or a behaviour, from their declarations."""

from __future__ import annotations

import argparse
import inspect
import sys

from pymoos_lite.config import registry
from pymoos_lite.config.parameters import Declaration, describe
from pymoos_lite.config.problems import did_you_mean


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", help="an app or behaviour, e.g. uTimerScript or BHV_Loiter")
    parser.add_argument("--example", action="store_true", help="print a block to paste into a mission file")


def run(args: argparse.Namespace) -> int:
    if not args.name:
        from pymoos_lite.tools.cli import usage

        print(usage())
        return 0
    for table, noun in ((registry.apps(), "app"), (registry.behaviors(), "behavior")):
        entry = table.find(args.name)
        if entry is None:
            continue
        if entry.host:
            print(f"{entry.name}: {entry.doc}")
            return 0
        try:
            cls = registry.load_target(entry.target)
        except ImportError as error:
            print(f"{entry.name}: {error}", file=sys.stderr)
            return 1
        print(example(entry.name, cls, noun) if args.example else page(entry.name, cls, noun))
        return 0
    names = [*registry.apps().names(), *registry.behaviors().names()]
    hint = did_you_mean(args.name, names)
    print(f"pymoos help: there is no app or behavior '{args.name}'{hint}", file=sys.stderr)
    return 1


def page(name: str, cls: type, noun: str) -> str:
    """The reference page of a class, as text."""
    own, base = declarations(cls, noun)
    parts = [f"{name} ({noun})", "", inspect.cleandoc(cls.__doc__ or ""), "", "Parameters:", describe(own)]
    parts += ["", f"Every {noun} also takes:", describe(base)]
    return "\n".join(parts)


def example(name: str, cls: type, noun: str) -> str:
    """A configuration block with every parameter at its default."""
    own, _ = declarations(cls, noun)
    head = f"ProcessConfig = {name}" if noun == "app" else f"Behavior = {name}"
    rows = [head, "{"]
    for parameter in own:
        default = parameter.default
        shown = parameter.example or (
            str(default).lower() if isinstance(default, bool) else "" if default is None else str(default)
        )
        note = f"  // {parameter.legal()}"
        rows.append(f"  {'' if shown else '// '}{parameter.name} = {shown}{note}")
    return "\n".join([*rows, "}"])


def declarations(cls: type, noun: str) -> tuple[Declaration, Declaration]:
    """A class's own parameters and those that all of its kind share."""
    own: Declaration = cls.PARAMETERS  # type: ignore[attr-defined]
    if noun == "app":
        from pymoos_lite.app.standard import STANDARD_PARAMETERS

        return own, STANDARD_PARAMETERS
    base: Declaration = getattr(cls, "BASE_PARAMETERS", Declaration())
    return own, base
