"""From options to behaviours: A_c and W of the decision problem, read off a `.bhv` file (gcid.md 9).

In a mission the row of A_c for an option is not a matrix in a file but the set of behaviours whose conditions
can hold once the option's outputs are posted. Modes are evaluated exactly; a behaviour's further conditions
on variables that change while sailing are reported with it instead of being guessed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ivp_helm.behavior_file import BehaviorBlock, BehaviorFile
from ivp_helm.conditions import Condition, ConditionError, parse_condition
from ivp_helm.info_buffer import InfoBuffer
from ivp_helm.modes import ModeSet
from opinion_engine.model import Floats
from opinion_engine.option_file import Option, OptionSet
from pymoos_lite.config.conditions import Joined, Known, Node, Not, Reference, Relation
from pymoos_lite.config.parameters import parse_number

DEFAULT_WEIGHT = 100.0
"""Priority of a behaviour that sets no `pwt`."""


@dataclass(frozen=True, eq=False)
class Activation:
    """A_c (N_O, q) of 0 and 1, W (q,), and how they came about.

    options, behaviors  names of rows and columns; kinds the behaviours' types
    modes      per option, the mode variables' values, e.g. `MODE = ACTIVE:EXPLORING`
    provided   (N_O, q) texts: what else must hold for the behaviour to run, empty if nothing
    warnings   one line each: options that activate nothing, conditions that cannot be read
    """

    options: tuple[str, ...]
    behaviors: tuple[str, ...]
    kinds: tuple[str, ...]
    a_c: NDArray[np.int64]
    weights: Floats
    modes: tuple[str, ...]
    provided: tuple[tuple[str, ...], ...]
    warnings: tuple[str, ...]

    def table(self) -> str:
        """The matrix as a text table, one behaviour per line, with notes on what else must hold."""
        width = max([len(name) for name in self.behaviors] + [9])
        columns = [max(len(option), 3) for option in self.options]
        rows = []
        for option, mode in zip(self.options, self.modes, strict=True):
            rows.append(f"{option}: {mode or 'no mode'}")
        rows.append("")
        heads = "  ".join(option.rjust(c) for option, c in zip(self.options, columns, strict=True))
        rows.append(f"{'behaviour':<{width}}  {'pwt':>6}  {heads}")
        notes: list[str] = []
        for q, name in enumerate(self.behaviors):
            cells = []
            for j, column in enumerate(columns):
                mark = str(self.a_c[j, q])
                note = self.provided[j][q]
                if self.a_c[j, q] and note:
                    if note not in notes:
                        notes.append(note)
                    mark += f"[{notes.index(note) + 1}]"
                cells.append(mark.rjust(column))
            rows.append(f"{name:<{width}}  {self.weights[q]:>6g}  {'  '.join(cells)}")
        if notes:
            rows.append("")
            rows += [f"[{k}] when {note}" for k, note in enumerate(notes, start=1)]
        if self.warnings:
            rows.append("")
            rows += [f"warning: {warning}" for warning in self.warnings]
        return "\n".join(rows)


def derive(file: BehaviorFile, options: OptionSet, assume: Mapping[str, str] | None = None) -> Activation:
    """A_c and W of `options` in a mission with the behaviours of `file`.

    For each option the initial values of the file hold, on top of them the option's own active conditions,
    `assume` and the option's outputs; the modes are evaluated from these. For the behaviours' own conditions,
    variables that no mode reads are open, unless they are among the last three: they change while sailing.
    """
    modes = ModeSet(file.modes)
    mode_variables = {entry.variable for entry in file.modes}
    blocks = [block for block in file.blocks if _condition_texts(block) is not None]
    warnings: list[str] = []
    conditions = [_conditions(block, warnings) for block in blocks]
    a_c = np.zeros((len(options), len(blocks)), dtype=np.int64)
    provided, reached = [], []
    for j, option in enumerate(options.options):
        known = _known(option, dict(assume or {}))
        buffer = InfoBuffer()
        for initial in file.initializations:
            buffer.set(initial.variable, initial.value)
        for variable, value in known.items():
            buffer.set(variable, value)
        assigned = modes.evaluate(buffer)
        reached.append(", ".join(f"{name} = {value}" for name, value in assigned.items()))
        settled = {
            name: buffer.value(name) for name in (*modes.variables(), *mode_variables) if name in buffer
        }
        table: dict[str, Known] = {**settled, **dict.fromkeys(mode_variables - settled.keys()), **known}
        notes = []
        for q, wanted in enumerate(conditions):
            verdicts = [(c, _verdict(c.root, table)) for c in wanted]
            open_ones = [str(c) for c, verdict in verdicts if verdict is None]
            a_c[j, q] = int(all(verdict is not False for _, verdict in verdicts))
            notes.append(" and ".join(open_ones))
        provided.append(tuple(notes))
        if not a_c[j].any():
            where = f"{option.file}:{option.line}: " if option.line else ""
            warnings.append(
                f"{where}option '{option.name}' activates no behaviour of {file.file or 'this file'}"
            )
    return Activation(
        options.names,
        tuple(block.name or block.kind for block in blocks),
        tuple(block.kind for block in blocks),
        a_c,
        np.array([_weight(block, warnings) for block in blocks], dtype=np.float64),
        tuple(reached),
        tuple(provided),
        tuple(warnings),
    )


def _known(option: Option, assume: dict[str, str]) -> dict[str, float | str]:
    """Values that hold while this option dominates: its conditions, the assumptions, its outputs."""
    known: dict[str, float | str] = {c.variable: c.value for c in option.conditions}
    for variable, text in (*assume.items(), *option.outputs):
        known[variable] = text
    return known


def _condition_texts(block: BehaviorBlock) -> list[tuple[str, int]] | None:
    return [(line.value, line.line) for line in block.lines if line.key.lower() == "condition"]


def _conditions(block: BehaviorBlock, warnings: list[str]) -> list[Condition]:
    found = []
    for text, line in _condition_texts(block) or ():
        try:
            found.append(parse_condition(text, legacy_commas=True))
        except ConditionError as error:
            warnings.append(f"{block.file}:{line}: behaviour '{block.name or block.kind}': {error}")
    return found


def _weight(block: BehaviorBlock, warnings: list[str]) -> float:
    lines = [line for line in block.lines if line.key.lower() in ("pwt", "priority")]
    if not lines:
        return DEFAULT_WEIGHT
    try:
        return parse_number(lines[-1].value)
    except ValueError:
        where = f"{block.file}:{lines[-1].line}"
        warnings.append(f"{where}: pwt of '{block.name or block.kind}' is not a number; taken as 100")
        return DEFAULT_WEIGHT


def _verdict(node: Node, known: Mapping[str, Known]) -> bool | None:
    """True, False, or None when it depends on variables that are not known (Kleene's logic)."""
    if isinstance(node, Relation):
        names = [node.name] + ([node.literal.name] if isinstance(node.literal, Reference) else [])
        return Condition(node).holds(known.get) if all(name in known for name in names) else None
    if isinstance(node, Not):
        inner = _verdict(node.inner, known)
        return None if inner is None else not inner
    assert isinstance(node, Joined)
    sides = (_verdict(node.left, known), _verdict(node.right, known))
    if node.word == "and":
        return _all(sides)
    negated = _all(None if side is None else not side for side in sides)
    return None if negated is None else not negated


def _all(sides: Iterable[bool | None]) -> bool | None:
    listed = list(sides)
    if False in listed:
        return False
    return None if None in listed else True
