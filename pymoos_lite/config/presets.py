"""Presets of a fleet file: tables under `presets` that are laid over the file itself, one after the other.

A preset holds the same keys as the file. A table is merged key by key; any other value, a list too,
replaces what was there. Lines stay those of the place a value was written at.
"""

from __future__ import annotations

from collections.abc import Sequence

from pymoos_lite.config.problems import Problem, did_you_mean
from pymoos_lite.config.strict_yaml import Scalar, Table, Tree

KEY = "presets"


def laid_over(base: Tree | None, top: Tree) -> Tree:
    """`base` with everything that `top` says; neither is changed."""
    if not isinstance(base, Table) or not isinstance(top, Table):
        return top
    items, lines = dict(base.items), dict(base.lines)
    for key, tree in top.items.items():
        items[key] = laid_over(items.get(key), tree)
        lines[key] = top.lines[key]
    return Table(items, lines, base.line)


def apply_presets(
    tree: Tree | None, chosen: Sequence[str], file: str, problems: list[Problem]
) -> Tree | None:
    """The file's tree without its presets, and with those `chosen` laid over it in that order."""
    if not isinstance(tree, Table):
        return tree
    presets = tree.items.get(KEY)
    line = tree.lines.get(KEY, tree.line)
    known = presets.items if isinstance(presets, Table) else {}
    if presets is not None and not isinstance(presets, Table):
        problems.append(Problem(file, line, f"{KEY}: expected a table of presets, 'name: {{...}}'"))
    rest: Tree = Table(
        {key: value for key, value in tree.items.items() if key != KEY},
        {key: value for key, value in tree.lines.items() if key != KEY},
        tree.line,
    )
    for name in chosen:
        preset = known.get(name)
        if preset is None:
            hint = did_you_mean(name, known) or (f"; there are {', '.join(known)}" if known else "")
            problems.append(Problem(file, line, f"there is no preset '{name}'{hint}"))
        elif isinstance(preset, Table):
            rest = laid_over(rest, preset)
        elif not (isinstance(preset, Scalar) and preset.tag == "null"):
            problems.append(Problem(file, preset.line, f"preset {name}: expected 'name: value' lines"))
    return rest
