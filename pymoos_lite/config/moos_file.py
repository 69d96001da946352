"""Reads the text of a `.moos` mission file into a `MissionFile` (community.md 1).

Pure: text in, record out. Where the reference is silent about a mistake, a `Problem` with file and line says
so; reading always goes on to the end, so that all problems are found at once.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from pymoos_lite.config.mission import KNOWN_GLOBALS, Block, ConfigLine, MissionFile, key_name, print_mission
from pymoos_lite.config.problems import Problem, did_you_mean

__all__ = ["Block", "ConfigLine", "MissionFile", "cut_comment", "parse_mission", "print_mission"]

_ESSENTIAL = ("ServerHost", "ServerPort", "Community", "MOOSTimeWarp", "LatOrigin", "LongOrigin")
_NSPLUG_WORDS = ("#include", "#define", "#ifdef", "#ifndef", "#else", "#elseifdef", "#endif")
_BLOCK_HEAD = re.compile(r"processconfig[ \t]*=", re.IGNORECASE)
_DEFINE = re.compile(r"define[ \t]*:(.*)", re.IGNORECASE | re.DOTALL)
_VARIABLE = re.compile(r"\$\{([^{}]*)\}")


def cut_comment(line: str) -> str:
    """`line` without its `//` comment; `//` between a pair of double quotes is text (community.md 1.2)."""
    if "//" not in line:
        return line
    slashes = line.find("//")
    position = 0
    while slashes >= 0:
        opening = line.find('"', position, slashes)
        closing = line.find('"', opening + 1) if opening >= 0 else -1
        if closing < 0:  # no quote before the slashes, or a lone one, which protects nothing
            return line[:slashes]
        position = closing + 1
        if slashes < position:
            slashes = line.find("//", position)
    return line


def parse_mission(
    text: str, file: str = "mission.moos", environment: Mapping[str, str] | None = None
) -> MissionFile:
    """Read the text of a `.moos` file. Never raises: whatever is wrong is in `problems` of the result.

    `environment` answers `${NAME}` where the file has no `define: NAME = value` of its own.
    """
    return _Reader(text, file, environment or {}).read()


class _Reader:
    """State of one pass over the lines: which block is open, what was found so far."""

    def __init__(self, text: str, file: str, environment: Mapping[str, str]) -> None:
        self.file = file
        self.environment = environment
        # Only the line feed ends a line: other separators that Unicode knows are parts of a value.
        raw = text.removeprefix("\ufeff").replace("\r", "").split("\n")
        self.rows = [(number, cut_comment(row).strip()) for number, row in enumerate(raw, start=1)]
        self.problems: list[Problem] = []
        self.globals: list[ConfigLine] = []
        self.blocks: list[Block] = []
        self.defines: list[ConfigLine] = []
        self.variables: dict[str, str] = {}
        self.unresolved: set[str] = set()
        self.app: str | None = None
        self.head_line = 0
        self.opened = False
        self.entries: list[ConfigLine] = []

    def error(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text, "error"))

    def warn(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text, "warning"))

    def read(self) -> MissionFile:
        rows = [row for row in self.rows if row[1] and not self.take_define(*row)]
        for number, row in rows:
            self.take(number, self.substitute(number, row))
        if self.app is not None:
            self.unclosed("the end of the file")
        self.check_globals()
        self.check_duplicate_blocks()
        return MissionFile(
            self.file,
            tuple(self.globals),
            tuple(self.blocks),
            tuple(self.defines),
            tuple(sorted(self.problems)),
        )

    def take_define(self, number: int, row: str) -> bool:
        """Definitions count for the whole file, also for lines above them."""
        match = _DEFINE.fullmatch(row)
        if match is None:
            return False
        key, equals, value = match[1].partition("=")
        key, value = "".join(key.split()), "".join(value.split())
        if not equals or not key:
            self.error(number, "expected 'define: NAME = VALUE'")
            return True
        if self.variables.get(key, value) != value:
            self.warn(number, f"variable {key} is defined again; this last value counts everywhere")
        self.variables[key] = value
        self.defines.append(ConfigLine(key, value, number))
        return True

    def substitute(self, number: int, row: str) -> str:
        if "${" not in row:
            return row

        def value(match: re.Match[str]) -> str:
            name = match[1].strip()
            if name in self.variables:
                return self.variables[name]
            if name in self.environment:
                return self.environment[name].replace("\n", " ").replace("\r", "")
            if name not in self.unresolved:
                self.unresolved.add(name)
                self.warn(
                    number,
                    f"${{{name}}} is neither defined in this file nor in the environment; left as it is",
                )
            return match[0]

        return _VARIABLE.sub(value, row).strip()

    def take(self, number: int, row: str) -> None:
        if not row:
            return
        if _BLOCK_HEAD.match(row):
            self.take_head(number, row)
        elif row.startswith("{"):
            self.take_opening(number, row)
        elif row.startswith("}"):
            self.take_closing(number, row)
        else:
            if self.app is not None and not self.opened:
                self.error(number, f"expected '{{' on the line after 'ProcessConfig = {self.app}'")
                self.opened = True
            self.take_entry(number, row)

    def take_head(self, number: int, row: str) -> None:
        if self.app is not None:
            self.unclosed(f"the next block on line {number}")
        app = "".join(row.partition("=")[2].split())
        rest = ""
        if "{" in app:
            app, _, rest = app.partition("{")
            self.error(number, f"'{{' must stand on a line of its own below 'ProcessConfig = {app}'")
        if not app:
            self.error(number, "ProcessConfig names no app: expected 'ProcessConfig = <app>'")
        self.app, self.head_line, self.opened, self.entries = app, number, "{" in row, []
        if rest.endswith("}"):
            self.close_block()

    def take_opening(self, number: int, row: str) -> None:
        rest = row[1:].strip()
        if self.app is None:
            self.warn(number, "'{' outside a ProcessConfig block is ignored")
            return
        if self.opened:
            self.error(
                number,
                f"'{{' inside the block of {self.app} (line {self.head_line}): is a '}}' missing above?",
            )
            return
        self.opened = True
        if rest.endswith("}"):
            self.error(number, "'{' and '}' must each stand on a line of their own")
            self.close_block()
        elif rest:
            self.warn(number, f"text after '{{' is ignored: {rest}")

    def take_closing(self, number: int, row: str) -> None:
        if self.app is None:
            self.warn(number, "'}' without an open ProcessConfig block is ignored")
            return
        if not self.opened:
            self.error(number, f"expected '{{' on the line after 'ProcessConfig = {self.app}'")
        if row[1:].strip():
            self.warn(number, f"text after '}}' is ignored: {row[1:].strip()}")
        self.close_block()

    def close_block(self) -> None:
        assert self.app is not None
        if self.app:
            self.blocks.append(Block(self.app, tuple(self.entries), self.head_line))
        self.app, self.opened, self.entries = None, False, []

    def unclosed(self, before: str) -> None:
        assert self.app is not None
        missing = "'}'" if self.opened else "'{' and '}'"
        self.error(self.head_line, f"the block of {self.app or '?'} has no closing {missing} before {before}")
        self.close_block()

    def take_entry(self, number: int, row: str) -> None:
        key, equals, value = (part.strip() for part in row.partition("="))
        # The reference keeps an otherwise useless line when it holds a square bracket.
        bracketed = "[" in row or "]" in row
        if equals and not key:
            self.warn(number, f"line has no name before '=' and is ignored: {_short(row)}")
        elif not value and not bracketed:
            word = row.split()[0]
            if word in _NSPLUG_WORDS:
                self.warn(number, f"'{word}' is ignored: it belongs to nsplug, expand this file first")
            elif equals:
                self.warn(number, f"'{_short(key)}' has no value and is ignored")
            else:
                self.warn(number, f"line has no '=' and is ignored: {_short(row)}")
        else:
            (self.globals if self.app is None else self.entries).append(ConfigLine(key, value, number))

    def check_globals(self) -> None:
        seen: dict[str, ConfigLine] = {}
        known = {key_name(name): name for name in KNOWN_GLOBALS}
        for entry in self.globals:
            first = seen.setdefault(entry.name, entry)
            if first is not entry and first.value != entry.value:
                self.warn(entry.line, f"{entry.key} is set on line {first.line} already; the first counts")
            if entry.name not in known:
                hint = did_you_mean(entry.name, KNOWN_GLOBALS, cutoff=0.85)
                if hint:
                    self.warn(entry.line, f"unknown global '{entry.key}'{hint}")
        for name in _ESSENTIAL:
            wanted = key_name(name)
            if wanted in seen:
                continue
            for block in self.blocks:
                inside = [entry for entry in block.lines if entry.name == wanted]
                if inside:
                    where = f"only inside the block of {block.app}"
                    self.warn(inside[0].line, f"{name} is set {where}; globals are read outside blocks")
                    break

    def check_duplicate_blocks(self) -> None:
        first: dict[str, Block] = {}
        for block in self.blocks:
            known = first.setdefault(key_name(block.app), block)
            if known is not block:
                self.warn(
                    block.line, f"second block of {block.app} is ignored; the first is on line {known.line}"
                )


def _short(text: str, width: int = 60) -> str:
    return text if len(text) <= width else text[: width - 3] + "..."
