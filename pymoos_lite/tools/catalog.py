"""``pymoos list [apps|behaviors|missions]``: what there is, one line each."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoos_lite.config import registry
from pymoos_lite.tools.mission import shipped_missions


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "what", nargs="?", choices=("apps", "behaviors", "missions"), help="default: all three"
    )


def run(args: argparse.Namespace) -> int:
    for what in [args.what] if args.what else ["apps", "behaviors", "missions"]:
        if not args.what:
            print(f"{what}:")
        rows = _missions() if what == "missions" else _entries(what)
        width = max((len(name) for name, _ in rows), default=0)
        for name, doc in rows:
            print(f"  {name:<{width}}  {doc}".rstrip())
    return 0


def _entries(what: str) -> list[tuple[str, str]]:
    table = registry.apps() if what == "apps" else registry.behaviors()
    rows = []
    for entry in table:
        also = f" (also: {', '.join(entry.aliases)})" if entry.aliases else ""
        rows.append((entry.name, entry.doc + also))
    return rows


def _missions() -> list[tuple[str, str]]:
    return [(name, first_sentence(folder / "README.md")) for name, folder in shipped_missions().items()]


def first_sentence(path: Path) -> str:
    """The first line of text of a Markdown file, headings apart."""
    if not path.is_file():
        return ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            return line.strip()
    return ""
