"""Macro expansion of mission templates, compatible with nsplug (community.md 2).

Pure: the text, the macros and a function that reads an include go in; the expanded text and every problem,
with file and line, come out. Bounded on hostile input: nesting, line length and output size have limits.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pymoos_lite.config.problems import Problem

# `None` is a macro that is defined without a value: `#define NAME`, a bare NAME on the command line.
Macros = dict[str, str | None]
# Include name -> (path to show and to compare, text), or None when there is no such file.
ReadFile = Callable[[str], tuple[str, str] | None]

_OPENING = re.compile(r"[$%]\(")

MAX_INCLUDE_DEPTH = 40
MAX_ROUNDS = 100
MAX_SUBSTITUTIONS = 10_000
MAX_LINE = 1_000_000
MAX_OUTPUT = 64_000_000


@dataclass(frozen=True, slots=True)
class Expansion:
    """`text` (to be written only if there are no errors), problems, and the macros at the end of the file."""

    text: str
    problems: tuple[Problem, ...]
    macros: Macros

    @property
    def errors(self) -> tuple[Problem, ...]:
        return tuple(p for p in self.problems if p.severity == "error")

    @property
    def undefined(self) -> tuple[Problem, ...]:
        """Those problems that are about undefined macros (nsplug's interactive mode asks about them)."""
        return tuple(p for p in self.problems if p.text.startswith("undefined macro"))


def expand(
    text: str,
    file: str,
    macros: Mapping[str, str | None],
    read: ReadFile,
    *,
    strict: bool = False,
    lenient: bool = False,
    tag: str | None = None,
) -> Expansion:
    """Expand a template. Never raises; an `Expansion` with errors must not be written anywhere.

    `strict` makes undefined macros (outside comments) errors; `lenient` expands the defined macros of a line
    that also has undefined ones, which otherwise stays as it is. `tag` takes only the part of `text` below
    `<tag> tag`.
    """
    run = _Expander(dict(macros), read, strict, lenient)
    try:
        run.process(_Source(file, text), tag, depth=0, top=True)
    except _TooLargeError as stop:
        run.problems.append(stop.problem)
    return Expansion("".join(line + "\n" for line in run.output), tuple(run.problems), run.macros)


def parse_macro_lines(
    text: str, file: str, macros: Mapping[str, str | None]
) -> tuple[Macros, tuple[Problem, ...]]:
    """Read a `--macros=FILE` file of `NAME=VALUE` lines; values may use macros that are known already."""
    known, problems = dict(macros), []
    for number, row in enumerate(text.split("\n"), start=1):
        row = row.strip()
        if not row or row.startswith(("#", "//")):
            continue
        name, equals, value = (part.strip() for part in row.partition("="))
        if not equals or not name or len(name.split()) != 1:
            problems.append(Problem(file, number, f"expected NAME=VALUE, found: {_short(row)}"))
            continue
        if len(value) > 1 and value[0] == value[-1] and value[0] in "\"'":
            value = value[1:-1]
        expanded, undefined = substitute(value, known)
        if undefined:
            problems.append(Problem(file, number, f"undefined macro {undefined[0]}", "warning"))
        known[name] = expanded
    return known, tuple(problems)


def substitute(text: str, macros: Mapping[str, str | None]) -> tuple[str, tuple[str, ...]]:
    """`text` with every `$(X)`, `%(X)`, `$(X=d)`, `$(X:=d)` replaced, and the macros that are undefined.

    Undefined macros stay in the text. Values and defaults may contain macros themselves; a definition that
    never comes to an end counts as undefined.
    """
    budget = _Budget()
    result = _substitute(text, macros, budget, 0)
    return result, tuple(dict.fromkeys(budget.undefined))


@dataclass(slots=True)
class _Budget:
    """What one line may still use up, and the undefined macros met on the way."""

    substitutions: int = MAX_SUBSTITUTIONS
    characters: int = MAX_LINE
    undefined: list[str] = field(default_factory=list)


def _substitute(text: str, macros: Mapping[str, str | None], budget: _Budget, depth: int) -> str:
    if "$(" not in text and "%(" not in text:
        return text
    pieces: list[str] = []
    position = 0
    closings = _matching(text)
    while opening := _OPENING.search(text, position):
        start = opening.start()
        end = closings.get(start + 1, -1)
        if end < 0:  # an opening without end is plain text
            pieces.append(text[position : start + 2])
            position = start + 2
            continue
        pieces.append(text[position:start])
        pieces.append(_value_of(text[start : end + 1], macros, budget, depth))
        position = end + 1
    pieces.append(text[position:])
    return "".join(pieces)


def _matching(text: str) -> dict[int, int]:
    """Where each opening parenthesis is closed."""
    closings: dict[int, int] = {}
    stack: list[int] = []
    for index, char in enumerate(text):
        if char == "(":
            stack.append(index)
        elif char == ")" and stack:
            closings[stack.pop()] = index
    return closings


def _value_of(macro: str, macros: Mapping[str, str | None], budget: _Budget, depth: int) -> str:
    """Replacement of one whole `$(...)` or `%(...)`; itself, noted as undefined, when there is none."""
    budget.substitutions -= 1
    if depth >= MAX_ROUNDS or budget.substitutions < 0 or budget.characters < 0:
        budget.undefined.append(f"{_short(macro)} (its definition never ends)")
        return macro
    body = macro[2:-1]
    split = _default_at(body)
    name, default = (body, None) if split < 0 else (body[:split], body[split + 1 :])
    needs_value = default is not None and name.endswith(":")
    name = _substitute(name.removesuffix(":") if needs_value else name, macros, budget, depth + 1)
    if not name or len(name.split()) != 1 or "(" in name or ")" in name:
        return macro  # such as $(a b) or $(): no macro, plain text
    if name in macros and (macros[name] or not needs_value):
        value = macros[name] or ""
    elif default is not None:
        value = default
    else:
        budget.undefined.append(macro)
        return macro
    value = _substitute(value, macros, budget, depth + 1)
    budget.characters -= len(value)
    return value.upper() if macro[0] == "%" else value


def _default_at(body: str) -> int:
    """Index of the `=` that starts a default, outside parentheses; -1 without one."""
    level = 0
    for index, char in enumerate(body):
        if char == "(":
            level += 1
        elif char == ")":
            level -= 1
        elif char == "=" and level == 0:
            return index
    return -1


@dataclass(frozen=True, slots=True)
class _Source:
    path: str
    text: str


@dataclass(slots=True)
class _Branch:
    """One open #ifdef or #ifndef. `live`: this branch is emitted; `taken`: some branch already was."""

    word: str
    line: int
    outer: bool
    live: bool
    taken: bool
    last: bool = False


class _TooLargeError(Exception):
    def __init__(self, problem: Problem) -> None:
        super().__init__(str(problem))
        self.problem = problem


class _Expander:
    def __init__(self, macros: Macros, read: ReadFile, strict: bool, lenient: bool) -> None:
        self.macros = macros
        self.read = read
        self.strict = strict
        self.lenient = lenient
        self.output: list[str] = []
        self.size = 0
        self.problems: list[Problem] = []
        self.open_files: list[tuple[str, str | None]] = []

    def error(self, source: _Source, line: int, text: str) -> None:
        self.problems.append(Problem(source.path, line, text, "error"))

    def warn(self, source: _Source, line: int, text: str) -> None:
        self.problems.append(Problem(source.path, line, text, "warning"))

    def process(self, source: _Source, tag: str | None, depth: int, top: bool = False) -> None:
        rows = source.text.removeprefix("\ufeff").split("\n")
        if not top and rows[-1] == "":
            rows.pop()  # a top file keeps the extra empty line of the reference, an include does not
        numbered = _tagged_part(rows, tag)
        if numbered is None:
            self.warn(source, 0, f"there is no part tagged <{tag}>")
            return
        if top and not source.text:
            self.warn(source, 0, "the input is empty")
            return
        self.open_files.append((source.path, tag))
        branches: list[_Branch] = []
        for number, row in numbered:
            row = row.removesuffix("\r")
            word, _, argument = row.replace("\t", " ").strip().partition(" ")
            if word in ("#ifdef", "#ifndef", "#elseifdef", "#else", "#endif"):
                self.branch(source, number, word, argument.strip(), branches)
            elif branches and not branches[-1].live:
                continue
            elif word == "#define":
                self.define(source, number, argument.strip())
            elif word == "#include":
                self.include(source, number, argument.strip(), depth)
            else:
                self.emit(source, number, self.expanded(source, number, row))
        for branch in branches:
            self.error(source, branch.line, f"{branch.word} has no #endif")
        self.open_files.pop()

    def emit(self, source: _Source, number: int, row: str) -> None:
        self.size += len(row) + 1
        if self.size > MAX_OUTPUT:
            text = f"the output grows beyond {MAX_OUTPUT // 1_000_000} MB here"
            raise _TooLargeError(Problem(source.path, number, text))
        self.output.append(row)

    def expanded(self, source: _Source, number: int, row: str) -> str:
        """The row with its macros replaced; as it is, and reported, when one of them is undefined."""
        if "$(" not in row and "%(" not in row:
            return row
        result, undefined = substitute(row, self.macros)
        if not undefined:
            return result
        if not row.lstrip().startswith("//"):
            kept = "it stays" if self.lenient else "the line stays as it is"
            text = f"undefined macro {', '.join(undefined[:5])} ({kept}): {_short(row.strip())}"
            self.problems.append(Problem(source.path, number, text, "error" if self.strict else "warning"))
        return result if self.lenient else row

    def define(self, source: _Source, number: int, argument: str) -> None:
        words = argument.split()
        name = words[0] if words else ""
        if name.startswith("$(") and name.endswith(")"):
            name = name[2:-1]
        if not name:
            self.error(source, number, "#define names no macro: expected '#define NAME [VALUE]'")
            return
        value = " ".join(words[1:]) if len(words) > 1 else None
        if name in self.macros and self.macros[name] != value:
            self.warn(source, number, f"macro {name} is defined again; the new value counts from here on")
        self.macros[name] = value

    def include(self, source: _Source, number: int, argument: str, depth: int) -> None:
        argument = self.expanded(source, number, argument)
        tag = None
        if argument.endswith(">") and "<" in argument:
            argument, _, tag = argument[:-1].rpartition("<")
            tag = tag.strip()
        name = argument.strip()
        if len(name) > 1 and name[0] == name[-1] == '"':
            name = name[1:-1]
        if not name:
            self.error(source, number, "#include names no file: expected '#include \"FILE\" [<tag>]'")
            return
        found = self.read(name)
        if found is None:
            self.error(source, number, f"cannot find or read the include '{name}'")
            return
        included = _Source(*found)
        if (included.path, tag) in self.open_files:
            self.error(source, number, f"'{name}' includes itself")
        elif depth >= MAX_INCLUDE_DEPTH:
            self.error(source, number, f"includes are nested more than {MAX_INCLUDE_DEPTH} deep")
        else:
            self.process(included, tag, depth + 1)

    def branch(self, source: _Source, number: int, word: str, argument: str, branches: list[_Branch]) -> None:
        outer = not branches or branches[-1].live
        if word in ("#ifdef", "#ifndef"):
            live = outer and self.condition(source, number, word, argument)
            branches.append(_Branch(word, number, outer, live, live))
            return
        if not branches:
            self.error(source, number, f"dangling {word}: no #ifdef is open")
            return
        current = branches[-1]
        if word == "#endif":
            branches.pop()
        elif current.last:
            self.error(
                source, number, f"dangling {word} after the #else of line {current.line}'s {current.word}"
            )
        elif word == "#else":
            current.live = current.outer and not current.taken
            current.taken = current.last = True
        elif current.word == "#ifndef":
            self.error(source, number, f"dangling #elseifdef: line {current.line} has #ifndef, not #ifdef")
        else:
            allowed = current.outer and not current.taken
            current.live = allowed and self.condition(source, number, "#ifdef", argument)
            current.taken = current.taken or current.live

    def condition(self, source: _Source, number: int, word: str, argument: str) -> bool:
        argument = self.expanded(source, number, argument)
        if word == "#ifndef":
            return bool(argument) and not any(self.has_value(name) for name in argument.split())
        either, both = "||" in argument, "&&" in argument
        if either and both:
            text = "|| and && in one condition: it counts as false"
            self.problems.append(Problem(source.path, number, text, "error" if self.strict else "warning"))
            return False
        if not argument:
            self.warn(source, number, "#ifdef without a macro counts as false")
            return False
        if both:
            return all(self.holds(part, alone_if_empty=True) for part in argument.split("&&"))
        return any(self.holds(part, alone_if_empty=False) for part in argument.split("||"))

    def has_value(self, name: str) -> bool:
        return name in self.macros and self.macros[name] != ""

    def holds(self, part: str, *, alone_if_empty: bool) -> bool:
        """`NAME`: defined (not empty, unless `alone_if_empty`); `NAME VALUE`: equal, also by macro VALUE."""
        words = part.split()
        if not words or words[0] not in self.macros:
            return False
        if len(words) == 1:
            return alone_if_empty or self.has_value(words[0])
        value, _ = substitute(self.macros[words[0]] or "", self.macros)
        wanted = " ".join(words[1:])
        if value == wanted:
            return True
        if wanted not in self.macros:
            return False
        return value == substitute(self.macros[wanted] or "", self.macros)[0]


def _tagged_part(rows: list[str], tag: str | None) -> list[tuple[int, str]] | None:
    """Numbered rows without tag lines; with a `tag` only those below its tag line; None if it has none."""
    kept: list[tuple[int, str]] = []
    current: str | None = None
    found = tag is None
    for number, row in enumerate(rows, start=1):
        stripped = row.replace("\t", " ").strip()
        if stripped.startswith("<tag>"):
            current = stripped[len("<tag>") :].strip().removeprefix("<").removesuffix(">").strip()
            found = found or current == tag
        elif tag is None or current == tag:
            kept.append((number, row))
    return kept if found else None


def _short(text: str, width: int = 80) -> str:
    return text if len(text) <= width else text[: width - 3] + "..."
