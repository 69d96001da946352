"""Logic conditions, as behaviours, modes, flags, timer scripts and mission evaluations write them.

A condition is parsed once into a tree and compiled to a closure; evaluating it costs a few lookups. The
language and its comparisons are helm.md 2: `and`/`or` join exactly two parenthesised operands, a variable
that was never received makes every comparison with it false, `==` between texts matches colon-separated fields.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mypy_extensions import mypyc_attr

from pymoos_lite.records.csp import parse_number

Known = float | str | bytes | None
# Name of a variable -> its latest value, None if it was never received.
Lookup = Callable[[str], Known]
Test = Callable[[Lookup], bool]

MAX_DEPTH = 50
DELTA = "_DELTA"

_RELATION = re.compile(r"([^\"><=!()]*)(==|!=|<=|>=|=|<|>)(.*)", re.DOTALL)
_FORBIDDEN = re.compile(r"[\"><=!()]")
_REFERENCE = re.compile(r"\$\(\s*([^\s\"><=!()$]+)\s*\)")
_JOINER = re.compile(r"(and|or)(?=[\s(!])", re.IGNORECASE)
_BARE_JOINER = re.compile(r"(?<!\S)(and|or)(?!\S)", re.IGNORECASE)
_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "=": operator.eq,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


class ConditionError(ValueError):
    """A text that is no condition; prints as one line: what is wrong and what would be right."""


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Reference:
    """The right side `$(NAME)`: the value of another variable."""

    name: str


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Relation:
    """`name op literal`. `literal` is as written: a text that looks like a number compares as one.

    `quoted` marks a literal in double quotes (stored without them), which is a text in any case.
    """

    name: str
    op: str
    literal: str | Reference
    quoted: bool = False


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Not:
    inner: Node


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Joined:
    """`(left) and (right)` or `(left) or (right)`; `word` is in lower case."""

    word: str
    left: Node
    right: Node


Node = Relation | Not | Joined


class Condition:
    """A parsed condition. Equal if the trees are equal; `str` gives text that parses to the same tree."""

    __slots__ = ("root", "test", "text", "warnings")

    def __init__(self, root: Node, text: str = "", warnings: tuple[str, ...] = ()) -> None:
        self.root = root
        self.text = text or print_node(root)
        self.warnings = warnings
        self.test = compile_node(root)
        """The condition compiled: what `holds` calls, for those who ask very often."""

    def holds(self, lookup: Lookup) -> bool:
        """Whether the condition is true for the values that `lookup` gives."""
        return self.test(lookup)

    def variables(self) -> tuple[str, ...]:
        """Names of the variables, in order of appearance, each once; `$(NAME)` references included."""
        return tuple(dict.fromkeys(_names(self.root)))

    def registrations(self) -> tuple[str, ...]:
        """What to register for: the variables and, for each `X_DELTA`, also the time stamp `X`."""
        names = self.variables()
        bases = (base for name in names if (base := delta_base(name)))
        return tuple(dict.fromkeys((*names, *bases)))

    def __str__(self) -> str:
        return print_node(self.root)

    def __repr__(self) -> str:
        return f"Condition({str(self)!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Condition) and self.root == other.root

    def __hash__(self) -> int:
        return hash(self.root)


def delta_base(name: str) -> str:
    """`X` for `X_DELTA`, else an empty text."""
    return name[: -len(DELTA)] if name.endswith(DELTA) and len(name) > len(DELTA) else ""


def with_deltas(lookup: Lookup, now: float) -> Lookup:
    """`lookup` that answers an `X_DELTA` which was never received itself by `now` minus the value of `X`."""

    def answer(name: str) -> Known:
        value = lookup(name)
        if value is not None or not name.endswith(DELTA):
            return value
        stamp = _as_number(lookup(delta_base(name)))
        return None if stamp is None else now - stamp

    return answer


def parse_condition(text: str, *, legacy_commas: bool = False) -> Condition:
    """Parse one condition.

    `legacy_commas` reads `DEPLOY,true` as `DEPLOY=true` (for the `condition` of a behaviour only).
    Raises `ConditionError` with one line that says what is wrong.
    """
    source = text.replace(",", "=") if legacy_commas else text
    warnings: list[str] = []
    root = _parse(source.strip(), warnings, 0)
    return Condition(root, text.strip(), tuple(warnings))


def _parse(text: str, warnings: list[str], depth: int) -> Node:
    if depth > MAX_DEPTH:
        raise ConditionError(f"a condition may be nested {MAX_DEPTH} deep at most")
    if not text:
        raise ConditionError("a condition or an operand is empty; expected VAR = VALUE")
    if text[0] not in "(!":
        return _parse_relation(text, warnings)
    left, rest = _operand(text, warnings, depth)
    if not rest:
        return left
    joiner = _JOINER.match(rest)
    if joiner is None:
        raise ConditionError(f"expected 'and' or 'or' before '{_short(rest)}'")
    after = rest[joiner.end() :].strip()
    if not after or after[0] not in "(!":
        raise ConditionError(
            f"both sides of '{joiner[1]}' must stand in parentheses: (A = 1) {joiner[1]} (B = 2)"
        )
    right, rest = _operand(after, warnings, depth)
    if rest:
        hint = "and/or join exactly two operands: write ((A) and (B)) and (C)"
        raise ConditionError(f"nothing may follow the second operand, found '{_short(rest)}'; {hint}")
    return Joined(joiner[1].lower(), left, right)


def _operand(text: str, warnings: list[str], depth: int) -> tuple[Node, str]:
    """The parenthesised expression, possibly negated, at the start of `text`, and what follows it."""
    negated = text[0] == "!"
    start = text[1:].strip() if negated else text
    if not start.startswith("("):
        raise ConditionError("'!' must stand before a parenthesis: !(A = 1)")
    level = 0
    for index, char in enumerate(start):
        if char == "(":
            level += 1
        elif char == ")":
            level -= 1
            if level == 0:
                inner = _parse(start[1:index].strip(), warnings, depth + 1)
                return (Not(inner) if negated else inner), start[index + 1 :].strip()
    raise ConditionError(f"a parenthesis is never closed in '{_short(text)}'")


def _parse_relation(text: str, warnings: list[str]) -> Relation:
    match = _RELATION.fullmatch(text)
    if match is None:
        raise ConditionError(f"expected VAR = VALUE (or ==, !=, <, <=, >, >=), found '{_short(text)}'")
    name, op, right = match[1].strip(), match[2], match[3].strip()
    if not name or name.lower() in ("and", "or"):
        raise ConditionError(f"a variable name is missing before '{op}' in '{_short(text)}'")
    if len(name.split()) != 1:
        raise ConditionError(f"'{_short(name)}' has a blank inside: expected one variable name before '{op}'")
    if not right:
        raise ConditionError(f"a value is missing after '{op}' in '{_short(text)}'")
    reference = _REFERENCE.fullmatch(right)
    if reference is not None:
        return Relation(name, op, Reference(reference[1]))
    quoted = len(right) > 1 and right[0] == right[-1] == '"'
    literal = right[1:-1] if quoted else right
    wrong = _FORBIDDEN.search(literal)
    if wrong is not None:
        raise ConditionError(_literal_complaint(text, literal, op, wrong[0]))
    if not quoted and literal.lower() in ("and", "or"):
        raise ConditionError(f"'{literal}' is no value; put it in quotes if it is meant as text")
    if not quoted and _BARE_JOINER.search(literal):
        warnings.append(f"'{_short(literal)}' is one text; for two conditions write (A = 1) and (B = 2)")
    return Relation(name, op, literal, quoted)


def _literal_complaint(text: str, literal: str, op: str, wrong: str) -> str:
    if _BARE_JOINER.search(literal):
        return f"both sides of and/or must stand in parentheses: (A = 1) or (B = 2), found '{_short(text)}'"
    if literal[0] in "=<>!":
        return f"there is no operator '{op}{literal[0]}'; expected one of = == != < <= > >="
    if wrong in "=<>!":
        return f"comparisons cannot be chained: '{_short(text)}'"
    if wrong == ")":
        return f"a parenthesis is closed that was never opened in '{_short(text)}'"
    return f"a value may not contain {wrong}, found '{_short(literal)}'"


def _short(text: str, width: int = 60) -> str:
    text = " ".join(text.split())
    return text if len(text) <= width else text[: width - 3] + "..."


def print_node(node: Node) -> str:
    """Text of a tree; parsing it gives the same tree."""
    if isinstance(node, Relation):
        if isinstance(node.literal, Reference):
            return f"{node.name} {node.op} $({node.literal.name})"
        literal = f'"{node.literal}"' if node.quoted else node.literal
        return f"{node.name} {node.op} {literal}"
    if isinstance(node, Not):
        return f"!({print_node(node.inner)})"
    return f"({print_node(node.left)}) {node.word} ({print_node(node.right)})"


def _names(node: Node) -> list[str]:
    if isinstance(node, Relation):
        return [node.name, node.literal.name] if isinstance(node.literal, Reference) else [node.name]
    if isinstance(node, Not):
        return _names(node.inner)
    return _names(node.left) + _names(node.right)


def fields_match(left: str, right: str) -> bool:
    """`==` of two texts: the colon-separated fields of the shorter are a contiguous part of the longer's."""
    longer = [field.strip() for field in left.split(":")]
    shorter = [field.strip() for field in right.split(":")]
    if len(longer) < len(shorter):
        longer, shorter = shorter, longer
    width = len(shorter)
    return any(longer[i : i + width] == shorter for i in range(len(longer) - width + 1))


def compile_node(node: Node) -> Test:
    """The tree as a function of a lookup."""
    if isinstance(node, Not):
        inner = compile_node(node.inner)
        return lambda lookup: not inner(lookup)
    if isinstance(node, Joined):
        left, right = compile_node(node.left), compile_node(node.right)
        if node.word == "and":
            return lambda lookup: left(lookup) and right(lookup)
        return lambda lookup: left(lookup) or right(lookup)
    if isinstance(node.literal, Reference):
        return _compare_variables(node.name, node.op, node.literal.name)
    number = parse_number(node.literal)
    if number is not None and not node.quoted:
        return _compare_with_number(node.name, node.op, number)
    return _compare_with_text(node.name, node.op, node.literal, number)


def _compare_with_number(name: str, op: str, number: float) -> Test:
    compare = _COMPARE[op]

    def test(lookup: Lookup) -> bool:
        value = lookup(name)
        if (
            type(value) is not float
        ):  # the common case first: this runs for every condition of every iteration
            value = _as_number(value)
        return value is not None and compare(value, number)

    return test


def _compare_with_text(name: str, op: str, literal: str, number: float | None) -> Test:
    """`number` is the literal's value if it looks like a number: a double compares with it as such."""
    compare = _COMPARE[op]
    compare_texts = _fields_test(literal) if op == "==" else lambda text: compare(text, literal)

    def test(lookup: Lookup) -> bool:
        value = lookup(name)
        if type(value) is str:
            return compare_texts(_bare(value) if value[:1] == '"' else value)
        if number is None or value is None or isinstance(value, str | bytes):
            return False
        return compare(value, number)

    return test


def _fields_test(literal: str) -> Callable[[str], bool]:
    """`fields_match` with one side known."""
    alone = literal.strip()

    def test(text: str) -> bool:
        if text == literal:
            return True
        if ":" in alone or not alone:
            return fields_match(text, literal)
        # One field against many: most modes are tested this way, and most texts do not even contain it.
        return alone in text and alone in [field.strip() for field in text.split(":")]

    return test


def _compare_variables(name: str, op: str, other: str) -> Test:
    compare = _COMPARE[op]

    def test(lookup: Lookup) -> bool:
        left, right = lookup(name), lookup(other)
        if isinstance(left, str) and isinstance(right, str):
            if op == "==":
                return fields_match(_bare(left), _bare(right))
            return compare(_bare(left), _bare(right))
        left_number, right_number = _as_number(left), _as_number(right)
        if left_number is None or right_number is None:
            return False
        return compare(left_number, right_number)

    return test


def _bare(text: str) -> str:
    """Text without one pair of surrounding double quotes."""
    return text[1:-1] if len(text) > 1 and text[0] == '"' and text[-1] == '"' else text


def _as_number(value: Known) -> float | None:
    if isinstance(value, str):
        return parse_number(_bare(value))
    return None if value is None or isinstance(value, bytes) else value
