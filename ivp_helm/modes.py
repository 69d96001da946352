"""Hierarchical modes: `set` blocks that give mode variables their values once per iteration (helm.md 3).

    set MODE = SURVEYING {
      MODE = ACTIVE
      SURVEY = true
    } LOITERING

An entry's first condition of the form ``MODE = TEXT`` names its parent: the value becomes ``TEXT:SURVEYING``.
Entries are evaluated in file order and see each other's assignments, so the first child that matches wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import is_

from mypy_extensions import mypyc_attr

from ivp_helm.conditions import Condition, ConditionSet, variables_of
from ivp_helm.info_buffer import InfoBuffer
from pymoos_lite.compiled.once import once
from pymoos_lite.config.conditions import Reference, Relation, delta_base

_NEVER = object()
"""Stands for the values before the first evaluation."""


def prefix_of(variable: str, condition: Condition) -> str | None:
    """The parent that a condition of the form ``MODEVAR = TEXT`` names, else None."""
    root = condition.root
    if isinstance(root, Relation) and root.name == variable and root.op == "=" and not root.quoted:
        bare = not condition.text.lstrip().startswith("(")
        return root.literal if bare and not isinstance(root.literal, Reference) else None
    return None


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class ModeEntry:
    """One `set` block; `line` is that of its header."""

    variable: str
    value: str
    conditions: tuple[Condition, ...] = ()
    else_value: str = ""
    line: int = field(default=0, compare=False)
    file: str = field(default="", compare=False)

    @once
    def parent(self) -> Condition | None:
        """The condition that names the parent mode, if there is one."""
        return next((c for c in self.conditions if prefix_of(self.variable, c) is not None), None)

    @once
    def prefix(self) -> str:
        """The parent mode, maybe with colons, or an empty text."""
        return (prefix_of(self.variable, self.parent) or "") if self.parent is not None else ""

    def __str__(self) -> str:
        body = "".join(f"  {condition.text}\n" for condition in self.conditions)
        return f"set {self.variable} = {self.value} {{\n{body}}} {self.else_value}".rstrip() + "\n"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class _Compiled:
    variable: str
    yes: str
    no: str
    conditions: ConditionSet
    parents: ConditionSet


class ModeSet:
    """All mode entries of a helm, ready for evaluation."""

    def __init__(self, entries: Sequence[ModeEntry] = ()) -> None:
        self.entries = tuple(entries)
        self._compiled = [_compile(entry) for entry in self.entries]
        self.assigned: dict[str, str] = {}
        """Values that the last evaluation gave; a variable that nobody assigned keeps its old value
        in the buffer but is not among them."""
        self._summary = "none"
        self._names = self.variables()
        self._ageing = any(delta_base(name) for name in self._names)
        self._seen: list[object] = [_NEVER]

    def variables(self) -> list[str]:
        """Variables that the conditions read."""
        return variables_of(c for entry in self.entries for c in entry.conditions)

    def evaluate(self, buffer: InfoBuffer) -> dict[str, str]:
        """Give the mode variables in `buffer` their values of now; returns those assigned, by variable."""
        get = buffer.values.get
        seen: list[object] = [get(name) for name in self._names]
        # The same values give the same modes, and between two orders they are the same for minutes.
        if not self._ageing and len(seen) == len(self._seen) and all(map(is_, seen, self._seen)):
            for variable, mode in self.assigned.items():
                buffer.assign(variable, mode)
            return self.assigned
        self._seen = seen
        assigned: dict[str, str] = {}
        for entry in self._compiled:
            if entry.conditions.first_false(buffer) is None:
                value = entry.yes
            elif entry.no and entry.parents.first_false(buffer) is None:
                value = entry.no
            else:
                continue
            assigned[entry.variable] = value
            buffer.assign(entry.variable, value)
        self.assigned = assigned
        self._summary = "#".join(f"{name}@{value}" for name, value in sorted(assigned.items())) or "none"
        return assigned

    def summary(self) -> str:
        """``MODE@ACTIVE:A#MODEX@B`` sorted by variable, or ``none``: the `modes` of IVPHELM_SUMMARY."""
        return self._summary

    def describe(self) -> str:
        """The value of IVPHELM_MODESET (helm.md 10.4): ``MODE#---,ACTIVE#---,INACTIVE#ACTIVE,A1``."""
        tokens = []
        last = ""
        for entry in self.entries:
            if entry.variable != last:
                tokens.append(entry.variable)
                last = entry.variable
            parent = entry.prefix.rpartition(":")[2] or "---"
            tokens.append(f"{parent},{entry.value}")
            if entry.else_value:
                tokens.append(f"{parent},{entry.else_value}")
        return "#".join(tokens)


def _compile(entry: ModeEntry) -> _Compiled:
    prefix = f"{entry.prefix}:" if entry.prefix else ""
    parents = ConditionSet(c for c in entry.conditions if prefix_of(entry.variable, c) is not None)
    return _Compiled(
        entry.variable,
        f"{prefix}{entry.value}",
        f"{prefix}{entry.else_value}" if entry.else_value else "",
        ConditionSet(entry.conditions),
        parents,
    )
