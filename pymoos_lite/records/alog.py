"""The .alog text format: header and entries, written and read (community.md 12.3).

Writing keeps every entry on one line; reading is streaming and tolerates what stock logs contain: several
lines in one value, entries out of order or twice, negative times, no header. Times are seconds since the
log's start.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from mypy_extensions import mypyc_attr

from pymoos_lite.core.message import Message

RULE = "%" * 59
_START = "%% LOGSTART"
_MARKED = "%% DATATYPE MARKING ON"
_DIGITS = frozenset("-+.0123456789")
_NUMERIC = _DIGITS | frozenset("ni")  # nan and inf too


class AlogEntry(NamedTuple):
    """One logged post. `source` includes `:aux` where the log has it; `number` is None for text."""

    time: float
    name: str
    source: str
    value: str
    number: float | None

    @property
    def app(self) -> str:
        """The source without its `:aux` part."""
        return self.source.partition(":")[0]


@dataclass(slots=True)
class AlogHeader:
    """What the comment lines at the top say; filled while reading."""

    start: float = 0.0
    marked: bool = False
    lines: list[str] = field(default_factory=list)

    def note(self, line: str) -> None:
        """Take one comment line."""
        self.lines.append(line)
        if line.startswith(_START):
            self.start = _number(line[len(_START) :].strip()) or 0.0
        elif line.startswith(_MARKED):
            self.marked = True


class AlogLine(NamedTuple):
    """One physical line: `entry` is None for comments, continuations of a value and garbage."""

    text: str
    entry: AlogEntry | None

    @property
    def is_comment(self) -> bool:
        return self.text.startswith("%")


def print_header(path: str, date: str, start: float, *, marked: bool = False) -> str:
    """The block at the top of a log; `date` like `Thu Jan  1 00:00:00 1970`, `start` in mission time."""
    rows = [
        RULE,
        f"%% LOG FILE:       {path}",
        f"%% FILE OPENED ON  {date}",
        f"{_START}        {start:>20.16g}",
        *([_MARKED] if marked else []),
        RULE,
    ]
    return "\n".join(rows) + "\n"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class AlogStyle:
    """How entries look.

    `precision` decimals; sources with `:aux`; with `@community` when it is not `community` (if that is set);
    values with their type in front.
    """

    precision: int = 5
    aux: bool = False
    community: str = ""
    marked: bool = False


def entry_printer(start: float, style: AlogStyle) -> Callable[[Message], str]:
    """A function that prints one message as one line; built once because it runs for every message.

    Columns are time (15.5), variable (20), source (15) and value, left-justified, one blank between, one at
    the end. Line feeds in texts become blanks, blanks in names underscores: an entry is one line.
    """
    columns: dict[tuple[str, str], str] = {}
    number = f"%-12.{style.precision}f \n"
    if style.marked:
        number = f"D:%.{style.precision}f \n"
    text_mark = "S:" if style.marked else ""
    with_aux, home = style.aux, style.community

    def print_columns(name: str, source: str) -> str:
        return f" {_word(name):<20} {_word(source):<15} "

    def full_source(message: Message) -> str:
        source = f"{message.source}:{message.aux}" if with_aux and message.aux else message.source
        if home and message.community and message.community != home:
            source += f"@{message.community}"
        return source

    stamped, stamp = start, f"{0.0:<15.5f}"

    def print_entry(message: Message) -> str:
        nonlocal stamped, stamp
        name, value, time, source, aux, _ = message
        if time != stamped:  # an app posts several variables in one step
            stamped, stamp = time, f"{time - start:<15.5f}"
        if (aux and with_aux) or home:
            middle = print_columns(name, full_source(message))
        else:
            known = columns.get((name, source))
            if known is None:
                known = columns[name, source] = print_columns(name, source)
            middle = known
        if type(value) is float:
            return stamp + middle + number % value
        return f"{stamp}{middle}{text_mark}{one_line(str(value))} \n"

    return print_entry


def one_line(text: str) -> str:
    """Text with line ends as blanks."""
    if "\n" in text or "\r" in text:
        return text.replace("\r\n", " ").replace("\n", " ").replace("\r", " ")
    return text


def _word(text: str) -> str:
    """A name fit to be one column."""
    return "_".join(text.split()) or "_"


def parse_entry(line: str, *, marked: bool = False) -> AlogEntry | None:
    """One entry from a line; None if the line does not begin with a time, a variable and a source."""
    columns = line.split(None, 3)
    count = len(columns)
    if count < 3:
        return None
    try:
        time = float(columns[0])
    except ValueError:
        return None
    if columns[0][0] not in _DIGITS:
        return None
    value = columns[3].rstrip() if count == 4 else ""
    if marked and value[:2] in ("D:", "S:"):
        kind, value = value[0], value[2:]
        return AlogEntry(time, columns[1], columns[2], value, _number(value) if kind == "D" else None)
    number = None
    # The first character decides most cases without the cost of an exception.
    if value and value[0] in _NUMERIC and "_" not in value:
        try:
            number = float(value)
        except ValueError:
            number = None
    return AlogEntry(time, columns[1], columns[2], value, number)


def _number(text: str) -> float | None:
    try:
        return float(text) if "_" not in text else None
    except ValueError:
        return None


def read_lines(lines: Iterable[str], header: AlogHeader | None = None) -> Iterator[AlogLine]:
    """Every line of a log with its entry, if it is one; `header` is filled on the way."""
    head = header if header is not None else AlogHeader()
    for text in lines:
        text = text.rstrip("\r\n")
        if text[:1] == "%":
            head.note(text)
            yield AlogLine(text, None)
        else:
            yield AlogLine(text, parse_entry(text, marked=head.marked))


def read_entries(lines: Iterable[str], header: AlogHeader | None = None) -> Iterator[AlogEntry]:
    """The entries of a log in file order; lines that continue a value are joined to it by line feeds."""
    head = header if header is not None else AlogHeader()
    pending: AlogEntry | None = None
    more: list[str] = []
    for text in lines:
        entry = None if text[:1] == "%" else parse_entry(text, marked=head.marked)
        if entry is not None:
            if pending is not None:
                yield _joined(pending, more) if more else pending
                more = []
            pending = entry
        elif text[:1] == "%":
            head.note(text.rstrip("\r\n"))
        elif pending is not None:
            more.append(text.rstrip("\r\n"))
    if pending is not None:
        yield _joined(pending, more)


def _joined(entry: AlogEntry, more: list[str]) -> AlogEntry:
    while more and not more[-1].strip():
        more.pop()
    if not more:
        return entry
    return entry._replace(value="\n".join([entry.value, *(row.rstrip() for row in more)]), number=None)
