"""Opening .alog files, and the patterns by which people name variables and apps in them (community.md 13)."""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pymoos_lite.records.alog import AlogEntry

LOG_SUFFIXES = (".alog", ".xlog", ".alog.gz", ".xlog.gz", ".klog")


class LogError(Exception):
    """A log that cannot be used; prints as one line."""


def read_log(name: str) -> Iterator[str]:
    """The lines of a log file (compressed or not); a folder stands for the one .alog in it.

    Raises LogError when there is no such file.
    """
    path = find_log(name)
    try:
        with gzip.open(path, "rb") if path.suffix == ".gz" else path.open("rb") as file:
            for line in file:
                yield line.decode("utf-8", errors="replace")
    except (OSError, EOFError) as refusal:
        raise LogError(f"{path}: cannot be read ({refusal})") from None


def find_log(name: str) -> Path:
    """The log file meant by `name`. Raises LogError."""
    path = Path(name)
    if path.is_dir():
        logs = sorted(p for s in (".alog", ".alog.gz") for p in path.glob(f"*{s}"))
        if len(logs) != 1:
            found = ", ".join(p.name for p in logs) or "none"
            raise LogError(f"{name}: expected a folder with one .alog, found {found}")
        return logs[0]
    if not path.is_file():
        raise LogError(f"{name}: no such log file")
    return path


def split_words(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Positional words as log files (by their ending or because there is such a folder) and patterns."""
    logs: list[str] = []
    patterns: list[str] = []
    for word in words:
        is_log = word.endswith(LOG_SUFFIXES) or ("/" in word and Path(word).is_dir()) or Path(word).is_dir()
        (logs if is_log else patterns).append(word)
    return logs, patterns


@dataclass(frozen=True, slots=True)
class Selection:
    """Names of variables and apps: exact, or a beginning with a star behind it."""

    exact: frozenset[str]
    prefixes: tuple[str, ...]

    @classmethod
    def of(cls, patterns: Iterable[str]) -> Selection:
        words = list(patterns)
        return cls(
            frozenset(w for w in words if not w.endswith("*")),
            tuple(w[:-1] for w in words if w.endswith("*")),
        )

    def covers(self, name: str) -> bool:
        return name in self.exact or name.startswith(self.prefixes)

    def picks(self, entry: AlogEntry) -> bool:
        """Whether the variable or the app (with or without its `:aux`) is meant."""
        return self.covers(entry.name) or self.covers(entry.app) or entry.source in self.exact
