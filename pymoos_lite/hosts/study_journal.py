"""What a study has found so far, on disk: a journal that survives a crash, and tables made from it.

The journal is one line of JSON for each finished row, in the order in which they came; a line cut off by a
crash is dropped. Tables are sorted by row and hold nothing that differs between two equal studies (the time
a run took is in the journal only).
"""

from __future__ import annotations

import csv
import hashlib
import importlib
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pymoos_lite.config.study_file import Row, StudyFile, parse_study
from pymoos_lite.hosts.study import Outcome

JOURNAL, TABLE, PARQUET, COPY = "journal.jsonl", "results.csv", "results.parquet", "study.yaml"


class JournalError(Exception):
    """The folder cannot be used for this study; the text is one line."""


def fingerprint(text: str) -> str:
    """Tells studies apart: equal for equal files."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class Journal:
    """The folder of one study. `outcomes` are all finished rows by number.

    Opening it reads what an earlier run of the same study left there.

    Raises:
        JournalError: it belongs to another study, or cannot be written.
    """

    def __init__(self, folder: Path, text: str) -> None:
        self.folder = folder
        self.outcomes: dict[int, Outcome] = {}
        self.damaged = 0
        path = folder / JOURNAL
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if path.exists():
                self._read(path, text)
            else:
                path.write_text(json.dumps({"study": fingerprint(text)}) + "\n", encoding="utf-8")
            (folder / COPY).write_text(text, encoding="utf-8")
            self._file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise JournalError(f"{folder}: {error.strerror or error}") from None

    def _read(self, path: Path, text: str) -> None:
        data = path.read_bytes()
        lines = data.decode("utf-8", "replace").splitlines()
        try:
            found = json.loads(lines[0])["study"] if lines else ""
        except (ValueError, KeyError, TypeError):
            found = ""
        if found != fingerprint(text) and not (found and self._asks_the_same(text)):
            raise JournalError(
                f"{self.folder} holds the results of another study (or of this one before its runs or columns "
                "were changed): give another folder with --out"
            )
        for line in lines[1:]:
            try:
                outcome = Outcome.from_json(json.loads(line))
            except (ValueError, KeyError, TypeError, AttributeError):
                self.damaged += 1
                continue
            self.outcomes[outcome.row] = outcome
        if data and not data.endswith(b"\n"):  # the next line must not continue the one that was cut off
            with path.open("a", encoding="utf-8") as file:
                file.write("\n")

    def _asks_the_same(self, text: str) -> bool:
        """Whether what changed since (comments, comparisons, what is watched) leaves the results valid."""
        try:
            former = (self.folder / COPY).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            return False
        return parse_study(text, COPY).same_runs(parse_study(former, COPY))

    def add(self, outcome: Outcome) -> None:
        """Write a finished row, at once."""
        self.outcomes[outcome.row] = outcome
        self._file.write(json.dumps(outcome.to_json(), sort_keys=True) + "\n")
        self._file.flush()

    def done(self) -> set[int]:
        """Numbers of the rows that need not be run again: failed ones are tried anew."""
        return {number for number, outcome in self.outcomes.items() if outcome.status == "ok"}

    def close(self) -> None:
        self._file.close()


def header(study: StudyFile) -> list[str]:
    """Names of the table's columns."""
    return ["row", *study.factors, "seed", "status", *study.columns]


def cells(study: StudyFile, row: Row, outcome: Outcome) -> list[object]:
    """One line of the table; None where there is nothing."""
    values = [outcome.values.get(column) for column in study.columns]
    factors = [row.value(name) or None for name in study.factors]
    return [row.number, *factors, row.seed, outcome.status, *values]


def finished(study: StudyFile, journal: Journal) -> Iterable[tuple[Row, Outcome]]:
    """Rows with their outcomes, in order."""
    for row in study.rows():
        outcome = journal.outcomes.get(row.number)
        if outcome is not None:
            yield row, outcome


def table_text(study: StudyFile, journal: Journal) -> str:
    """The table as CSV; numbers in their shortest exact form."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header(study))
    for row, outcome in finished(study, journal):
        writer.writerow(["" if cell is None else _shown(cell) for cell in cells(study, row, outcome)])
    return out.getvalue()


def _shown(cell: object) -> str:
    if isinstance(cell, float) and cell == int(cell) and abs(cell) < 1e15:
        return str(int(cell))
    return repr(cell) if isinstance(cell, float) else str(cell)


def write_tables(study: StudyFile, journal: Journal) -> list[Path]:
    """Write the table as CSV, and as Parquet where pyarrow is installed; the files written."""
    path = journal.folder / TABLE
    path.write_text(table_text(study, journal), encoding="utf-8")
    try:
        pyarrow: Any = importlib.import_module("pyarrow")
        parquet: Any = importlib.import_module("pyarrow.parquet")
    except ImportError:
        return [path]
    rows = [cells(study, row, outcome) for row, outcome in finished(study, journal)]
    arrays = {}
    for i, name in enumerate(header(study)):
        kind = pyarrow.float64() if name in study.columns else pyarrow.string()
        if name in ("row", "seed"):
            kind = pyarrow.int64()
        arrays[name] = pyarrow.array([row[i] for row in rows], type=kind)
    parquet.write_table(pyarrow.table(arrays), journal.folder / PARQUET)
    return [path, journal.folder / PARQUET]
