"""What is wrong with a configuration, and where: one line each, ready to print.

Readers of mission files collect problems instead of stopping at the first one, so that `check` can show
all of them at once. Nothing here decides what happens next: an error refuses a launch, a warning does not.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """One finding about a file. `line` counts from 1; 0 means the file as a whole."""

    file: str
    line: int
    text: str
    severity: Severity = "error"

    @property
    def where(self) -> str:
        return f"{self.file}:{self.line}" if self.line > 0 else self.file

    def __str__(self) -> str:
        return f"{self.where}: {self.severity}: {self.text}"


class ConfigurationError(ValueError):
    """A value of a configuration that cannot be used; carries the `Problem` and prints as its one line."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(f"{problem.where}: {problem.text}")
        self.problem = problem


def errors(problems: Iterable[Problem]) -> tuple[Problem, ...]:
    """Only those that must stop a launch."""
    return tuple(p for p in problems if p.severity == "error")


def nearest(word: str, known: Iterable[str], cutoff: float = 0.7) -> str | None:
    """The known spelling closest to `word`, ignoring case, or None when nothing is close enough."""
    spelling = {name.lower(): name for name in known}
    found = difflib.get_close_matches(word.lower(), list(spelling), n=1, cutoff=cutoff)
    return spelling[found[0]] if found else None


def did_you_mean(word: str, known: Iterable[str], cutoff: float = 0.7) -> str:
    """`; did you mean 'x'?` for the nearest known spelling, or an empty text."""
    found = nearest(word, known, cutoff)
    return f"; did you mean '{found}'?" if found else ""
