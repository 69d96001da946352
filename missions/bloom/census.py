"""The collisions of a whole study, by cause: runs that had some are sailed again with all their logs, and looked at.

A study keeps numbers, no logs. Equal rows give equal runs, so a run can be seen again whenever somebody asks; one that
does not come out as it did then is told of and not counted. What was found is kept beside the results, a line for each
close encounter, and a census that was stopped goes on from there.
"""

from __future__ import annotations

import csv
import io
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from missions.bloom.encounters import CAUSES, read_encounters
from pymoos_lite.config.study_file import StudyFile, parse_study
from pymoos_lite.hosts.study import Outcome, run_row
from pymoos_lite.hosts.study_journal import COPY, JOURNAL, Journal, JournalError
from pymoos_lite.hosts.study_workers import ProcessWorkers
from pymoos_lite.tools.log_reading import LogError

TABLE = "encounters.csv"
COLUMN = "collisions"
"""The study's column that counts them."""
METHOD = "method"
FIELDS = (
    "row",
    METHOD,
    "vehicles",
    "seed",
    "time",
    "rank",
    "cpa",
    "one",
    "other",
    "one_doing",
    "other_doing",
    "cause",
)
Line = dict[str, str]


def look_again(text: str, file: str, number: int) -> dict[str, Any]:
    """Sail a row again and say who came too close to whom: what workers do. Never raises."""
    study = parse_study(text, file)
    with tempfile.TemporaryDirectory(prefix="pymoos_census_") as scratch:
        answer = run_row(study, study.row(number), Path(scratch)).to_json()
        if answer["status"] == "ok":
            try:
                answer["met"] = [
                    [f"{met.time:.1f}", met.rank, f"{met.cpa:.2f}", *met.names, *met.doing, met.cause]
                    for met in read_encounters(Path(scratch))
                ]
            except LogError as error:
                answer["status"] = f"failed: {error}"
    return answer


class Census:
    """The close encounters of a study's results, as far as they were looked at.

    Raises:
        JournalError: the folder holds no results, or results without the column that counts collisions.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            self.text = (folder / COPY).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise JournalError(f"{folder / COPY}: {getattr(error, 'strerror', None) or error}") from None
        self.study: StudyFile = parse_study(self.text, str((folder / COPY).resolve()))
        if self.study.problems:
            raise JournalError(str(self.study.problems[0]))
        if COLUMN not in self.study.columns or not (folder / JOURNAL).exists():
            raise JournalError(f"{folder}: it takes the results of a study with a column '{COLUMN}'")
        journal = Journal(folder, self.text)
        journal.close()
        self.outcomes: Mapping[int, Outcome] = {
            number: outcome for number, outcome in journal.outcomes.items() if outcome.status == "ok"
        }
        self._rows = {row.number: row for row in self.study.rows()}
        self.found: dict[int, list[Line]] = {}
        self._read()

    def _read(self) -> None:
        path = self.folder / TABLE
        if not path.exists():
            return
        with path.open(encoding="utf-8", newline="") as file:
            for line in csv.DictReader(file):
                if None not in line.values() and line["row"].isdigit():
                    self.found.setdefault(int(line["row"]), []).append(dict(line))
        # Whatever a stop has cut off is looked at again.
        self.found = {
            row: lines for row, lines in self.found.items() if len(_collisions(lines)) == self.counted(row)
        }

    def counted(self, number: int) -> int:
        """How many collisions the study counted in a row."""
        outcome = self.outcomes.get(number)
        return int((outcome.values.get(COLUMN) if outcome is not None else None) or 0)

    def to_look_at(self) -> list[int]:
        """Rows with collisions that nobody has looked at yet."""
        numbers = [n for n in self.outcomes if self.counted(n) and n not in self.found]
        return self.study.in_order(numbers)

    def look(self, workers: int) -> Iterator[str]:
        """Look at all that is left, and write down each row as it is ready; what went wrong with it, or nothing."""
        pool = ProcessWorkers(self.text, self.study.file, workers, look_again)
        with closing(pool.answers(self.to_look_at())) as answers:
            for answer in answers:
                yield self._take(answer)
        self._write()

    def _take(self, answer: Mapping[str, Any]) -> str:
        again = Outcome.from_json(answer)
        if again.status != "ok":
            return f"row {again.row}: {again.status}"
        if dict(again.values) != dict(self.outcomes[again.row].values):
            return f"row {again.row}: not the run of the study (another version?)"
        row = self._rows[again.row]
        whose = (str(again.row), row.value(METHOD), row.value("vehicles"), str(row.seed))
        self.found[again.row] = [dict(zip(FIELDS, (*whose, *met), strict=True)) for met in answer["met"]]
        self._write()
        return ""

    def _write(self) -> None:
        out = io.StringIO()
        writer = csv.DictWriter(out, FIELDS, lineterminator="\n")
        writer.writeheader()
        for number in sorted(self.found):
            writer.writerows(self.found[number])
        fresh = self.folder / f"{TABLE}.new"
        fresh.write_text(out.getvalue(), encoding="utf-8")
        fresh.replace(self.folder / TABLE)

    def lines(self) -> list[str]:
        """How many collisions of each cause each method had, and what was looked at."""
        groups: dict[str, list[int]] = {}
        for number in sorted(self.outcomes):
            groups.setdefault(self._rows[number].value(METHOD) or "all", []).append(number)
        met = {
            name: [m for n in of for m in _collisions(self.found.get(n, ()))] for name, of in groups.items()
        }
        told = [_line("", groups)]
        for cause, meaning in CAUSES.items():
            told.append(
                _line(cause, (sum(m["cause"] == cause for m in met[name]) for name in groups), meaning)
            )
        unseen = ([self.counted(n) for n in of if n not in self.found] for of in groups.values())
        told.append(_line("unseen", map(sum, unseen), "not looked at yet"))
        told.append(_line("runs", map(len, groups.values())))
        told.append(
            _line(
                "of them", (sum(self.counted(n) > 0 for n in of) for of in groups.values()), "had collisions"
            )
        )
        return told


def _line(name: str, cells: Iterable[object], meaning: str = "") -> str:
    return (f"{name:<12}" + "".join(f"{cell!s:>8}" for cell in cells) + f"   {meaning}").rstrip()


def _collisions(lines: Sequence[Line]) -> list[Line]:
    return [line for line in lines if line["rank"] == "collision"]
