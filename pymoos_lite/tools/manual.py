"""``pymoos help NAME``: the parameters of an app or a behaviour, from their declarations."""

from __future__ import annotations

import argparse
import inspect
import sys
from pathlib import Path

from pymoos_lite.config import registry
from pymoos_lite.config.parameters import Declaration, describe
from pymoos_lite.config.problems import did_you_mean


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", help="an app or behaviour, e.g. uTimerScript or BHV_Loiter")
    parser.add_argument(
        "--write", type=Path, metavar="DIR", help="write a page of every app and behaviour into a folder"
    )
    parser.add_argument("--example", action="store_true", help="print a block to paste into a mission file")


def run(args: argparse.Namespace) -> int:
    if args.write is not None:
        count = write_reference(args.write)
        print(f"{count} pages in {args.write}")
        return 0
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


def write_reference(folder: Path) -> int:
    """Write one Markdown page per app and behaviour, and an index; returns how many pages."""
    folder.mkdir(parents=True, exist_ok=True)
    index = ["# Reference", "", "Made by `pymoos help --write`; each page is what `pymoos help NAME` prints."]
    count = 0
    for table, noun in ((registry.apps(), "app"), (registry.behaviors(), "behavior")):
        index += ["", f"## {noun.capitalize()}s", ""]
        for entry in sorted(table, key=lambda e: e.name.lower()):
            if entry.host:
                index.append(f"- {entry.name}: {entry.doc}")
                continue
            text = page(entry.name, registry.load_target(entry.target), noun)
            path = folder / f"{entry.name}.md"
            path.write_text(f"# {entry.name}\n\n```text\n{text}\n```\n", encoding="utf-8")
            index.append(f"- [{entry.name}]({path.name}): {entry.doc}")
            count += 1
    (folder / "index.md").write_text("\n".join(index) + "\n", encoding="utf-8")
    return count


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
