"""YAML without its surprises: a tree of texts that know their line, and every problem found on the way.

Values stay as written; what a text means is decided by whoever asks for a number, a truth value or a
name. So `no` is a fine name and never silently false: where YAML itself would have turned a text
into something else (`on`, `010`, `12:30`, a date), a reader that wants a text says so with file and
line. Keys given twice are errors. Hostile input is bounded in size, depth and aliases.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from pymoos_lite.config.parameters import parse_number
from pymoos_lite.config.problems import Problem, did_you_mean

MAX_TEXT = 4 << 20
MAX_NODES = 200_000
MAX_DEPTH = 40

_SWITCHES = frozenset(["y", "n", "yes", "no", "on", "off"])


@dataclass(frozen=True, slots=True)
class Scalar:
    """One value as written; `plain` is False when it stood in quotes, `tag` is what YAML takes it for."""

    text: str
    line: int
    plain: bool = True
    tag: str = "str"


@dataclass(frozen=True, slots=True)
class Listing:
    """A sequence."""

    items: tuple[Tree, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Table:
    """A mapping, in file order; `lines` is where each key stands."""

    items: dict[str, Tree]
    lines: dict[str, int]
    line: int


Tree = Scalar | Listing | Table


class _Refused(Exception):
    def __init__(self, line: int, text: str) -> None:
        super().__init__(text)
        self.line = line


def read_yaml(text: str, file: str, problems: list[Problem]) -> Tree | None:
    """The tree of a YAML text, None if it cannot be read; problems are appended with file and line."""
    import yaml

    if len(text) > MAX_TEXT:
        problems.append(Problem(file, 0, f"a text of {len(text)} characters is longer than {MAX_TEXT}"))
        return None
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = error.problem or error.context or "not YAML"
        problems.append(Problem(file, mark.line + 1 if mark else 0, f"not YAML: {what}"))
        return None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        problems.append(
            Problem(file, 0, f"not YAML: {str(error).splitlines()[0] if str(error) else error!r}")
        )
        return None
    if root is None:
        problems.append(Problem(file, 0, "the file is empty"))
        return None
    walker = _Walker(file, problems)
    try:
        return walker.walk(root, 0)
    except _Refused as refusal:
        problems.append(Problem(file, refusal.line, str(refusal)))
        return None


@dataclass(slots=True)
class _Walker:
    file: str
    problems: list[Problem]
    nodes: int = field(default=0)

    def walk(self, node: object, depth: int) -> Tree:
        import yaml

        assert isinstance(node, yaml.Node)
        line = node.start_mark.line + 1
        # Counted at each visit: an alias costs as much as what it stands for.
        self.nodes += 1
        if self.nodes > MAX_NODES or depth > MAX_DEPTH:
            raise _Refused(line, "too many values, or nested too deeply")
        if isinstance(node, yaml.MappingNode):
            return self._table(node, line, depth)
        if isinstance(node, yaml.SequenceNode):
            return Listing(tuple(self.walk(child, depth + 1) for child in node.value), line)
        assert isinstance(node, yaml.ScalarNode)
        return Scalar(node.value, line, node.style is None, node.tag.rpartition(":")[2])

    def _table(self, node: object, line: int, depth: int) -> Table:
        items: dict[str, Tree] = {}
        lines: dict[str, int] = {}
        for key_node, value_node in node.value:  # type: ignore[attr-defined]
            key = self.walk(key_node, depth + 1)
            if not isinstance(key, Scalar):
                raise _Refused(key.line, "a key must be a word")
            if key.tag == "merge":
                raise _Refused(key.line, "'<<' is not understood here: write the values out")
            if key.plain and key.tag == "bool":
                self.problems.append(
                    Problem(
                        self.file, key.line, f"key '{key.text}' means true or false in YAML: put it in quotes"
                    )
                )
            if key.text in items:
                text = f"'{key.text}' was already given at line {lines[key.text]}"
                self.problems.append(Problem(self.file, key.line, text))
                continue
            items[key.text] = self.walk(value_node, depth + 1)
            lines[key.text] = key.line
        return Table(items, lines, line)


class Reader:
    """Takes the values of one table by key, with types, and notes every problem.

    Each method returns the default when the key is absent or its value unusable; `done` says which
    keys nobody asked for.
    """

    def __init__(self, tree: Tree | None, file: str, where: str, problems: list[Problem]) -> None:
        self.file = file
        self.where = where
        self.problems = problems
        self.line = tree.line if tree is not None else 0
        self._asked: dict[str, None] = {}
        self._table = Table({}, {}, self.line)
        if isinstance(tree, Table):
            self._table = tree
        elif tree is not None and not (isinstance(tree, Scalar) and tree.tag == "null"):
            self.problem(tree.line, f"{where}: expected 'name: value' lines")

    def problem(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text))

    def __contains__(self, key: str) -> bool:
        self._asked[key] = None
        return key in self._table.items

    def line_of(self, key: str) -> int:
        return self._table.lines.get(key, self.line)

    def get(self, key: str) -> Tree | None:
        """The value itself; None when absent or empty."""
        self._asked[key] = None
        tree = self._table.items.get(key)
        return None if isinstance(tree, Scalar) and tree.plain and tree.tag == "null" else tree

    def text(self, key: str, default: str = "") -> str:
        tree = self.get(key)
        return default if tree is None else self.as_text(tree, key, default)

    def as_text(self, tree: Tree, key: str, default: str = "") -> str:
        """A text; refuses what YAML itself would not have taken for one."""
        if not isinstance(tree, Scalar):
            self.problem(tree.line, f"{key}: expected one value")
            return default
        if tree.plain and tree.tag in ("bool", "timestamp", "null"):
            kind = {"bool": "true or false", "timestamp": "a date", "null": "nothing"}[tree.tag]
            self.problem(tree.line, f"{key}: '{tree.text}' means {kind} in YAML: put it in quotes")
            return default
        return tree.text

    def number(self, key: str, default: float, low: float | None = None, high: float | None = None) -> float:
        tree = self.get(key)
        return default if tree is None else self.as_number(tree, key, default, low, high)

    def as_number(
        self, tree: Tree, key: str, default: float, low: float | None = None, high: float | None = None
    ) -> float:
        """A number in [low, high], written in the plain decimal way."""
        value = None
        if isinstance(tree, Scalar):
            try:
                value = parse_number(tree.text)
            except ValueError:
                value = None
        if value is None:
            shown = tree.text if isinstance(tree, Scalar) else "a list or table"
            self.problem(tree.line, f"{key}: expected a number, found '{shown}'")
            return default
        assert isinstance(tree, Scalar)
        if tree.tag == "int" and tree.text.lstrip("+-").startswith("0") and tree.text.lstrip("+-") != "0":
            self.problem(tree.line, f"{key}: '{tree.text}' would be read as octal: write it without the zero")
            return default
        if (low is not None and value < low) or (high is not None and value > high):
            limits = (f"at least {low:g}" if low is not None else "") + (
                f"{' and ' if low is not None and high is not None else ''}"
                f"{f'at most {high:g}' if high is not None else ''}"
            )
            self.problem(tree.line, f"{key}: {tree.text} is out of range: give {limits}")
            return default
        return value

    def integer(self, key: str, default: int, low: int | None = None, high: int | None = None) -> int:
        tree = self.get(key)
        if tree is None:
            return default
        value = self.as_number(tree, key, default, low, high)
        if value != int(value):
            self.problem(tree.line, f"{key}: expected a whole number, found {value:g}")
            return default
        return int(value)

    def flag(self, key: str, default: bool) -> bool:
        """`true` or `false`, and nothing else that YAML might take for it."""
        tree = self.get(key)
        if tree is None:
            return default
        word = tree.text.lower() if isinstance(tree, Scalar) else ""
        if word not in ("true", "false"):
            self.problem(tree.line, f"{key}: expected true or false, found '{word or 'a list or table'}'")
            return default
        return word == "true"

    def texts(self, key: str) -> list[str]:
        """A list of texts; one text counts as a list of one."""
        tree = self.get(key)
        if tree is None:
            return []
        if isinstance(tree, Listing):
            return [self.as_text(item, key) for item in tree.items]
        return [self.as_text(tree, key)]

    def table(self, key: str) -> Reader:
        return Reader(self.get(key), self.file, key, self.problems)

    def entries(self) -> Iterator[tuple[str, Tree]]:
        """All keys and values, in file order."""
        for key, tree in self._table.items.items():
            self._asked[key] = None
            yield key, tree

    def done(self) -> None:
        """Note the keys that nobody asked for."""
        known = list(self._asked)
        for key in self._table.items:
            if key not in self._asked:
                hint = did_you_mean(key, known) or f"; known are {', '.join(known)}"
                self.problem(self._table.lines[key], f"{self.where} has no '{key}'{hint}")
