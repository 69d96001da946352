"""What the logger writes besides .alog entries: file names and dates, the .slog table, .ylog rows.

Pure text, made from what is handed in (community.md 12.2 and 12.4); the .alog format is `records.alog`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from pymoos_lite.core.message import Message
from pymoos_lite.records.alog import RULE, one_line

WIDTH = 18
HEADER_EVERY = 30


def log_stem(name: str, unix_time: float, *, stamped: bool, utc: bool) -> str:
    """Name of a log's folder and files: `LOG_ABE_23_11_2026_____00_35_26`, or `name` if not `stamped`."""
    if not stamped:
        return name
    at = time.gmtime(unix_time) if utc else time.localtime(unix_time)
    day = f"{at.tm_mday}_{at.tm_mon}_{at.tm_year}"
    return f"{name}_{day}_____{at.tm_hour:02d}_{at.tm_min:02d}_{at.tm_sec:02d}"


def log_date(unix_time: float, *, utc: bool) -> str:
    """The date of a log's header, like `Thu Jan  1 00:00:00 1970`."""
    return time.asctime(time.gmtime(unix_time) if utc else time.localtime(unix_time))


def copy_name(name: str) -> str:
    """Name of a file's copy in the log folder: `alpha.bhv` becomes `alpha._bhv`."""
    stem, dot, extension = name.rpartition(".")
    return f"{stem}._{extension}" if dot and stem else f"{name}._"


def binary_marker(stem: str, offset: int, size: int) -> str:
    """What an .alog says in place of a binary value that stands in the .blog."""
    return f"<MOOS_BINARY>File={stem}.blog,Offset={offset},Bytes={size}</MOOS_BINARY>"


def print_ylog_row(message: Message, start: float) -> str:
    """One operator's note (`MOOS_DEBUG`, `MOOS_SYSTEM`)."""
    value = message.value if isinstance(message.value, str) else message.text
    age = f"{message.time - start:.3f}"
    return f"{age:<10} {message.name:<20} {message.source:<20} {one_line(value):<20}\n"


@dataclass(slots=True)
class SyncTable:
    """The .slog: one row per period with the doubles that arrived since the row before, else `NaN`.

    `spare` columns have no variable yet; `offer` gives one to each new variable while there are any.
    """

    columns: list[str]
    spare: int = 0
    _fresh: dict[str, float] = field(default_factory=dict)
    _known: set[str] = field(default_factory=set)
    _rows: int = 0

    def __post_init__(self) -> None:
        self._known.update(self.columns)

    def header(self) -> str:
        rows = [f"%%   ({i}) {name}" for i, name in enumerate(self._titles(), start=1)]
        return "\n".join([*rows, RULE]) + "\n"

    def wants(self, name: str) -> bool:
        """Whether values of this variable may ever stand in the table."""
        return self.spare > 0 or name in self._known

    def offer(self, name: str, value: float) -> str:
        """Take a value for the next row; returns a comment line when the variable got a spare column."""
        note = ""
        if name not in self._known:
            if not self.spare:
                return note
            self.spare -= 1
            self._known.add(name)
            self.columns.append(name)
            note = f"%%   ({len(self.columns) + 1}) {name}\n"
        self._fresh[name] = value
        return note

    def row(self, age: float) -> str:
        """The row for `age` seconds since the log's start, below the titles where they are due."""
        cells = [
            f"{age:.7g}",
            *(f"{self._fresh[n]:.7g}" if n in self._fresh else "NaN" for n in self.columns),
        ]
        cells += ["NaN"] * self.spare
        self._fresh.clear()
        row = _padded(cells) + "\n"
        if self._rows % HEADER_EVERY == 0:
            row = f"%% {_padded(self._titles())}\n%% TIME [{age:7.2f}]\n{row}"
        self._rows += 1
        return row

    def _titles(self) -> list[str]:
        return ["TIME", *self.columns, *(f"SPARE_{i}" for i in range(1, self.spare + 1))]


def _padded(cells: Sequence[str]) -> str:
    return " ".join(f"{cell:<{WIDTH}}" for cell in cells)
