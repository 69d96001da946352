"""The `.bhv` reader: text in; initial values, modes, behaviour blocks and problems out (helm.md 1).

All problems of a file are collected, each with its file and 1-based line; nothing is opened and no
behaviour is built here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ivp_helm.conditions import Condition, ConditionError, parse_condition
from ivp_helm.flags import typed_value
from ivp_helm.modes import ModeEntry
from pymoos_lite.config.conditions import Relation
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.problems import Problem, did_you_mean
from pymoos_lite.geometry.text import split_protected

KEYWORDS = ("initialize", "initialize_", "set", "Behavior")
_HEAD = re.compile(r"(initialize_?|set)\s+(\S.*)|(behavior)\s*=(.*)", re.IGNORECASE | re.DOTALL)
_NSPLUG = re.compile(r"#\s*(include|ifdef|ifndef|else|elseifdef|endif|define)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Initialization:
    """One `initialize VAR = VALUE`; a deferred one waits until it is clear that nobody else gave a value."""

    variable: str
    value: float | str
    deferred: bool = False
    line: int = 0


@dataclass(frozen=True, slots=True)
class BehaviorBlock:
    """One `Behavior = TYPE { ... }`, parameters as written, in file order; `line` is that of its header."""

    kind: str
    lines: tuple[ConfigLine, ...]
    line: int = 0
    file: str = ""

    def last(self, key: str) -> ConfigLine | None:
        """The line that counts for a parameter given once: the last one."""
        found = [entry for entry in self.lines if entry.key == key]
        return found[-1] if found else None

    @property
    def name(self) -> str:
        """The name it gives itself, maybe empty."""
        line = self.last("name") or self.last("descriptor")
        return line.value if line else ""


@dataclass(frozen=True, slots=True)
class BehaviorFile:
    """What a `.bhv` file says."""

    file: str = ""
    initializations: tuple[Initialization, ...] = ()
    modes: tuple[ModeEntry, ...] = ()
    blocks: tuple[BehaviorBlock, ...] = ()
    problems: tuple[Problem, ...] = ()

    @property
    def errors(self) -> tuple[Problem, ...]:
        return tuple(p for p in self.problems if p.severity == "error")


def read_behavior_file(text: str, file: str = "") -> BehaviorFile:
    """Read a `.bhv` text. Never raises: what is wrong stands in `problems`."""
    return _Reader(file).read(text)


def print_behavior_file(content: BehaviorFile) -> str:
    """A text that reads back as the same initial values, modes and blocks."""
    rows = []
    for entry in content.initializations:
        word = "initialize_" if entry.deferred else "initialize"
        value = entry.value if isinstance(entry.value, str) else repr(entry.value)
        quote = '"' if isinstance(entry.value, str) and typed_value(value) != value else ""
        rows.append(f"{word} {entry.variable} = {quote}{value}{quote}\n")
    rows += [f"{entry}" for entry in content.modes]
    for block in content.blocks:
        body = "".join(f"  {line.key} = {line.value}\n" for line in block.lines)
        rows.append(f"Behavior = {block.kind}\n{{\n{body}}}\n")
    return "\n".join(rows)


# --- lines ------------------------------------------------------------------------------------------------


class _Token(NamedTuple):
    text: str
    line: int


def logical_lines(text: str) -> Iterable[_Token]:
    """Physical lines joined at a trailing backslash, each with the number of its first line."""
    joined = ""
    first = 0
    for number, raw in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1):
        first = first or number
        bare = raw.rstrip(" \t")
        if bare.endswith("\\"):
            joined += bare[:-1]
            continue
        yield _Token(joined + raw, first)
        joined, first = "", 0
    if first:
        yield _Token(joined, first)


def cut_comment(text: str) -> tuple[str, bool]:
    """The line without its ``//`` comment, and whether a ``//`` inside quotes was left alone."""
    spared = False
    start = 0
    while (at := text.find("//", start)) >= 0:
        before = text[:at]
        if before.count('"') % 2 == 0 or '"' not in text[at:]:
            return before.strip(" \t"), spared
        spared = True
        start = at + 2
    return text.strip(" \t"), spared


def _separate_braces(text: str) -> list[str]:
    """A line cut where a brace begins or ends it; a trailing ``}`` only if it closes nothing in the line."""
    if len(text) < 2 or text.startswith("#"):
        return [text]
    if text[0] in "{}":
        return [text[0], *_separate_braces(text[1:].lstrip(" \t"))] if text[1:].strip() else [text[0]]
    if text[-1] == "{":
        return [text[:-1].rstrip(" \t"), "{"]
    if text[-1] == "}" and text.count("}") > text.count("{"):
        return [text[:-1].rstrip(" \t"), "}"]
    return [text]


# --- grammar ----------------------------------------------------------------------------------------------


class _Reader:
    """One pass over the tokens of a file."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.problems: list[Problem] = []
        self.initializations: list[Initialization] = []
        self.modes: list[ModeEntry] = []
        self.blocks: list[BehaviorBlock] = []
        self.tokens: list[_Token] = []
        self.at = 0

    def error(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text))

    def warning(self, line: int, text: str) -> None:
        self.problems.append(Problem(self.file, line, text, "warning"))

    def read(self, text: str) -> BehaviorFile:
        for raw, line in logical_lines(text):
            bare, spared = cut_comment(raw)
            if spared:
                self.warning(line, "'//' inside quotes is kept; MOOS-IvP would take it for a comment")
            self.tokens += [_Token(piece, line) for piece in _separate_braces(bare)]
        while self.at < len(self.tokens):
            token = self._next()
            if token.text:
                self._item(token)
        return BehaviorFile(
            self.file,
            tuple(self.initializations),
            tuple(self.modes),
            tuple(self.blocks),
            tuple(sorted(self.problems)),
        )

    def _next(self) -> _Token:
        token = self.tokens[self.at]
        self.at += 1
        return token

    def _peek(self) -> str:
        return self.tokens[self.at].text if self.at < len(self.tokens) else ""

    def _item(self, token: _Token) -> None:
        if token.text == "{":
            self._ignored_block(token)
            return
        head = _HEAD.match(token.text)
        if head is None:
            self.error(token.line, _unknown_item(token.text))
        elif head[3]:
            self._behavior(token, head[4].strip())
        elif head[1].lower() == "set":
            self._mode(token, head[2])
        else:
            self._initialize(token, head[2], head[1].endswith("_"))

    def _initialize(self, token: _Token, text: str, deferred: bool) -> None:
        for piece in split_protected(text, ","):
            name, equals, value = (part.strip() for part in piece.partition("="))
            if not equals or not name or not value or re.search(r"\s", name):
                self.error(token.line, f"initialize: '{piece}' is not VARIABLE = VALUE")
                continue
            self.initializations.append(Initialization(name, typed_value(value), deferred, token.line))

    def _behavior(self, token: _Token, kind: str) -> None:
        if "{" in kind or "}" in kind:
            self.error(
                token.line, "a block on one line: put '{', each parameter and '}' on lines of their own"
            )
            return
        if not kind:
            self.error(token.line, "Behavior = needs the type of a behavior, e.g. BHV_Waypoint")
        body = self._body(token, f"Behavior = {kind}")
        if body is None or not kind:
            return
        lines = []
        for entry in body:
            key, _, value = entry.text.partition("=")
            lines.append(ConfigLine(key.strip().lower(), value.strip(), entry.line))
        self.blocks.append(BehaviorBlock(kind, tuple(lines), token.line, self.file))

    def _mode(self, token: _Token, text: str) -> None:
        variable, equals, value = (part.strip() for part in text.partition("="))
        if "{" in text or "}" in text:
            self.error(
                token.line, "a set block on one line: put each condition and '}' on lines of their own"
            )
            return
        if not equals or not variable or not value or re.search(r"\s", variable):
            self.error(token.line, f"set: '{text}' is not VARIABLE = VALUE")
            value = ""
        body = self._body(token, f"set {variable} = {value}")
        if body is None:
            return
        conditions = [found for entry in body if (found := self._mode_condition(entry)) is not None]
        else_value = self._else_value()
        if value:
            entry = ModeEntry(variable, value, tuple(conditions), else_value, token.line, self.file)
            self.modes.append(entry)

    def _mode_condition(self, token: _Token) -> Condition | None:
        try:
            condition = parse_condition(token.text)
        except ConditionError as error:
            hint = ""
            if token.text.lower().startswith("condition"):
                hint = "; lines of a set block are bare conditions, without 'condition ='"
            self.error(token.line, f"{error}{hint}")
            return None
        for warning in condition.warnings:
            self.warning(token.line, warning)
        root = condition.root
        if isinstance(root, Relation) and root.op == "==":
            self.error(token.line, f"'{token.text}': a set block compares with a single '='")
            return None
        return condition

    def _else_value(self) -> str:
        """The word after the closing brace, on its line or the next one."""
        text = self._peek()
        if not text or text in "{}" or _HEAD.match(text):
            return ""
        token = self._next()
        if len(token.text.split()) != 1:
            self.error(
                token.line,
                f"after '}}' of a set block: expected one word as else value, found '{token.text}'",
            )
            return ""
        return token.text

    def _body(self, head: _Token, what: str) -> list[_Token] | None:
        """The lines between the braces, None (and a problem) if there is no proper block."""
        while self.at < len(self.tokens) and not self._peek():
            self.at += 1
        if self._peek() != "{":
            self.error(head.line, f"{what}: expected '{{' after it")
            return None
        self.at += 1
        body: list[_Token] = []
        while self.at < len(self.tokens):
            token = self._next()
            if token.text == "}":
                return body
            if token.text == "{":
                self.error(token.line, f"{what}: unexpected '{{' in its block")
                continue
            beheaded = _HEAD.match(token.text)
            if beheaded is not None and beheaded[3]:
                self.error(head.line, f"{what}: its block is not closed before line {token.line}")
                self.at -= 1
                return body
            if token.text:
                body.append(token)
        self.error(head.line, f"{what}: its block is not closed at the end of the file")
        return None

    def _ignored_block(self, head: _Token) -> None:
        """A block whose header is commented out: skipped, but its end must be clear."""
        while self.at < len(self.tokens):
            token = self._next()
            if token.text == "{":
                self.error(token.line, "unexpected '{' in a block without header")
            elif token.text == "}":
                follower = self._peek()
                if follower and follower != "{" and not _HEAD.match(follower):
                    self.error(
                        self.tokens[self.at].line,
                        f"'{follower}' after a block without header: expected a blank line",
                    )
                    self.at += 1
                return
        self.error(head.line, "a block without header is not closed at the end of the file")


def _unknown_item(text: str) -> str:
    if _NSPLUG.match(text):
        return f"'{text}' is for nsplug: run nsplug on this file first"
    if text.startswith("#"):
        return f"'{text}': '#' starts no comment here; use '//'"
    word = re.split(r"[\s=]", text, maxsplit=1)[0]
    expected = f"expected one of {', '.join(KEYWORDS)} or a block"
    return f"'{text}' is nothing known{did_you_mean(word, KEYWORDS)}; {expected}"


def merge(files: Sequence[BehaviorFile]) -> BehaviorFile:
    """Several files as one, in the order given."""
    return BehaviorFile(
        files[0].file if len(files) == 1 else "",
        tuple(i for f in files for i in f.initializations),
        tuple(m for f in files for m in f.modes),
        tuple(b for f in files for b in f.blocks),
        tuple(p for f in files for p in f.problems),
    )
