"""From blocks of a `.bhv` file to behaviours: classes found, parameters given, all complaints collected.

Nothing is half built: a block with any problem gives no behaviour, and a helm that has a problem does not
drive (helm.md 1.5).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from ivp_helm.base_parameters import TEMPLATE_PARAMETERS
from ivp_helm.behavior import Behavior
from ivp_helm.behavior_file import BehaviorBlock
from ivp_helm.surroundings import Surroundings
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import ParameterError
from pymoos_lite.config.problems import Problem

Finder = Callable[[str], type[Behavior]]
"""Gives the class of a type name; raises LookupError or ImportError with one line saying why not."""


@dataclass
class Template:
    """A block from which instances are made on request (helm.md 7.2). `prefix` begins their names."""

    block: BehaviorBlock
    cls: type[Behavior]
    prefix: str
    updates: str
    limit: int = 0
    clone: bool = False
    tried: int = 0
    made: int = 0


@dataclass
class Built:
    """What came of the blocks, in file order; `samples` are the templates' instances that validated them."""

    behaviors: list[tuple[Behavior, BehaviorBlock]] = field(default_factory=list)
    templates: list[Template] = field(default_factory=list)
    samples: list[Behavior] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    order: list[Behavior] = field(default_factory=list)
    """Behaviours and samples in file order, for `on_helm_start`."""


def build_all(
    blocks: Iterable[BehaviorBlock], find: Finder, surroundings: Surroundings, accept_retired: bool = False
) -> Built:
    """Build every block; problems carry file and line.

    With `accept_retired` deprecated behaviours and retired parameters are warnings instead of errors.
    """
    built = Built()
    for block in blocks:
        try:
            cls = find(block.kind)
        except (LookupError, ImportError) as error:
            text = error.args[0] if error.args else str(error)
            built.problems.append(Problem(block.file, block.line, str(text)))
            continue
        mode, limit, found = _template_settings(block)
        built.problems += found
        behavior, found = build_behavior(cls, block, surroundings, accept_retired=accept_retired)
        built.problems += found
        if behavior is None:
            continue
        built.order.append(behavior)
        if mode in ("spawn", "clone"):
            behavior.is_template = True
            if not behavior.config.updates or " " in behavior.config.updates:
                text = f"{block.kind} '{behavior.name}': templating needs 'updates = VARIABLE'"
                built.problems.append(Problem(block.file, block.line, text))
            template = Template(block, cls, behavior.name, behavior.config.updates, limit, mode == "clone")
            built.templates.append(template)
        if mode == "spawn":
            built.samples.append(behavior)
        else:
            built.behaviors.append((behavior, block))
    built.problems += _clashes(built.behaviors)
    built.problems.sort()
    return built


def build_behavior(
    cls: type[Behavior],
    block: BehaviorBlock,
    surroundings: Surroundings,
    name: str = "",
    more: Sequence[ConfigLine] = (),
    accept_retired: bool = False,
) -> tuple[Behavior | None, list[Problem]]:
    """One behaviour from a block and, for spawning, `more` lines on top; None if anything is wrong.

    `name` overrides the block's own name.
    """
    problems: list[Problem] = []
    try:
        behavior = cls(surroundings)
    except Exception as error:
        text = f"{block.kind} cannot be made: {type(error).__name__}: {error}"
        return None, [Problem(block.file, block.line, text)]
    label = name or block.name or behavior.name
    for line in (*block.lines, *more):
        if TEMPLATE_PARAMETERS.find(line.key) is not None:
            continue
        instead = cls.RETIRED.get(line.key)
        if instead is not None:
            text = f"{block.kind} '{label}': parameter '{line.key}' is retired; {instead}"
            problems.append(Problem(block.file, line.line, text, "warning" if accept_retired else "error"))
            continue
        try:
            behavior.set_parameter(line.key, line.value)
        except ParameterError as error:
            problems.append(Problem(block.file, line.line, f"{block.kind} '{label}': {error}"))
        except Exception as error:
            text = f"{block.kind} '{label}': {line.key} raised {type(error).__name__}: {error}"
            problems.append(Problem(block.file, line.line, text))
    behavior.name = name or behavior.config.name or behavior.name
    if cls.DEPRECATED and not behavior.config.i_understand_this_behavior_is_deprecated:
        text = f"{block.kind} '{label}': {cls.DEPRECATED}; or add i_understand_this_behavior_is_deprecated = true"
        problems.append(Problem(block.file, block.line, text, "warning" if accept_retired else "error"))
    try:
        for complaint in behavior.check():
            problems.append(Problem(block.file, block.line, f"{block.kind} '{label}': {complaint}"))
    except Exception as error:
        text = f"{block.kind} '{label}': check raised {type(error).__name__}: {error}"
        problems.append(Problem(block.file, block.line, text))
    return (None if any(p.severity == "error" for p in problems) else behavior), problems


def _template_settings(block: BehaviorBlock) -> tuple[str, int, list[Problem]]:
    lines = [line for line in block.lines if TEMPLATE_PARAMETERS.find(line.key) is not None]
    bound = TEMPLATE_PARAMETERS.bind(lines, f"{block.kind} '{block.name}'", block.file)
    return bound.values.templating, bound.values.max_spawnings, bound.problems


def _clashes(behaviors: Sequence[tuple[Behavior, BehaviorBlock]]) -> list[Problem]:
    """No name may begin another one: log tools and updates match names by their beginnings (helm.md 1.3)."""
    problems = []
    for i, (later, block) in enumerate(behaviors):
        for earlier, other in behaviors[:i]:
            short, long = sorted((earlier.name, later.name), key=len)
            if long.startswith(short):
                text = (
                    f"Duplicate behavior name found: {later.name}: no name may begin another one, "
                    f"and line {other.line} has '{earlier.name}'"
                )
                problems.append(Problem(block.file, block.line, text))
                break
    return problems
