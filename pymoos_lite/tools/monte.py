"""``pymoos monte STUDY.yaml``: many seeded runs of a mission, here or on a cluster, and what they say."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pymoos_lite.config.study_file import StudyFile
    from pymoos_lite.hosts.study import Outcome
    from pymoos_lite.hosts.study_journal import Journal
    from pymoos_lite.tools.mission import MissionError

STUDY_FILE = "study.yaml"
TELL_PERIOD = 60.0
"""Wall seconds between two lines of progress where no terminal shows a bar."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "study",
        metavar="STUDY",
        help=f"a study file, a folder with a {STUDY_FILE}, or a shipped mission's name",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the results (default studies/NAME)"
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: one for each processor)"
    )
    parser.add_argument("--dask", metavar="ADDRESS", help="run on the Dask cluster whose scheduler is there")
    parser.add_argument("--row", type=int, metavar="N", help="run only row N again, with all its logs")
    parser.add_argument("--rows", metavar="A-B", help="run only these rows, e.g. 1-50")
    parser.add_argument(
        "--where", metavar="FACTOR=VALUE,...", action="append", default=[],
        help="run only rows with one of these values of a factor, e.g. method=gcid,static (repeatable)",
    )  # fmt: skip
    parser.add_argument("--list", action="store_true", help="print the rows, and run nothing")
    parser.add_argument("--summary", action="store_true", help="print what the results say, and run nothing")
    parser.add_argument("--no-progress", action="store_true", help="print only the closing lines")


def run(args: argparse.Namespace) -> int:
    from pymoos_lite.hosts.study_journal import JournalError
    from pymoos_lite.tools.mission import MissionError

    try:
        return _run(args)
    except (MissionError, JournalError) as error:
        print(error, file=sys.stderr)
        return 1


def _run(args: argparse.Namespace) -> int:
    from pymoos_lite.hosts.study_journal import Journal

    study, text = load_study(args.study)
    if args.list:
        for row in study.rows():
            print(row.number, *(f"{name}={value}" for name, value in row.factors), f"seed={row.seed}")
        return 0
    out: Path = args.out or Path("studies") / study.name
    if args.row is not None:
        return _again(study, args.row, out)
    journal = Journal(out, text)
    try:
        if not args.summary:
            with stoppable():
                _work(study, text, journal, args)
        return _tell(study, journal)
    finally:
        journal.close()


@contextmanager
def stoppable() -> Iterator[None]:
    """Inside, being asked to end is Ctrl-C: the workers end too, and what is done stays done.

    A shell starts background jobs with Ctrl-C ignored, so that is set as well.
    """

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = [(number, signal.signal(number, stop)) for number in (signal.SIGINT, signal.SIGTERM)]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def load_study(name: str) -> tuple[StudyFile, str]:
    """The study meant by `name`, and its text.

    Raises:
        MissionError: it cannot be found, opened or understood; all problems but the last are printed.
    """
    from pymoos_lite.config.study_file import parse_study
    from pymoos_lite.tools.mission import MissionError, shipped_missions

    path = Path(name).expanduser()
    if path.is_dir():
        path /= STUDY_FILE
    elif not path.exists() and name in shipped_missions():
        path = shipped_missions()[name] / STUDY_FILE
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MissionError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    study = parse_study(text, str(path.resolve()))
    if study.problems:
        *others, last = study.problems
        for problem in others:
            print(problem, file=sys.stderr)
        raise MissionError(str(last))
    return study, text


def _chosen(study: StudyFile, rows: str | None, where: Sequence[str]) -> list[int]:
    """Numbers of the rows asked for, in order of number."""
    wanted = [_condition(study, text) for text in where]
    everything = range(1, study.row_count + 1)
    span = everything if rows is None else _span(study, rows)
    if not wanted:
        return list(span)
    chosen = [
        row.number
        for row in study.rows()
        if row.number in span and all(row.value(name) in values for name, values in wanted)
    ]
    if not chosen:
        raise _refusal(f"--where {' '.join(where)}: no row has these values")
    return chosen


def _span(study: StudyFile, rows: str) -> range:
    first, dash, last = rows.partition("-")
    if not first.isdigit() or (dash and not last.isdigit()):
        raise _refusal(f"--rows {rows}: expected A-B, e.g. 1-50")
    chosen = range(int(first), int(last if dash else first) + 1)
    if not chosen or chosen[0] < 1 or chosen[-1] > study.row_count:
        raise _refusal(f"--rows {rows}: the study has rows 1 to {study.row_count}")
    return chosen


def _condition(study: StudyFile, text: str) -> tuple[str, frozenset[str]]:
    from pymoos_lite.config.problems import did_you_mean

    name, equals, values = text.partition("=")
    if not equals or not values:
        raise _refusal(f"--where {text}: expected FACTOR=VALUE,..., e.g. method=gcid,static")
    if name not in study.factors:
        hint = did_you_mean(name, study.factors) or f"; factors are {', '.join(study.factors)}"
        raise _refusal(f"--where {text}: the study has no factor '{name}'{hint}")
    return name, frozenset(values.split(","))


def _refusal(text: str) -> MissionError:
    from pymoos_lite.tools.mission import MissionError

    return MissionError(text)


def _work(study: StudyFile, text: str, journal: Journal, args: argparse.Namespace) -> None:
    from pymoos_lite.hosts.study_journal import write_tables
    from pymoos_lite.hosts.study_workers import ProcessWorkers, default_workers, run_here
    from pymoos_lite.tools.mission import MissionError

    done = journal.done()
    numbers = study.in_order(number for number in _chosen(study, args.rows, args.where) if number not in done)
    workers = args.workers if args.workers is not None else default_workers()
    if workers < 1:
        raise MissionError(f"--workers {workers}: expected at least 1")
    if done and numbers:
        print(f"{study.name}: {len(done)} runs are done already, {len(numbers)} to go", file=sys.stderr)
    outcomes: Iterator[Outcome]
    if args.dask:
        outcomes = _on_dask(study, text, numbers, args.dask)
    elif workers == 1:
        outcomes = run_here(text, study.file, numbers)
    else:
        outcomes = ProcessWorkers(text, study.file, min(workers, max(1, len(numbers)))).run(numbers)
    progress = Progress(len(numbers), quiet=args.no_progress)
    try:
        for outcome in outcomes:
            journal.add(outcome)
            progress.one(outcome.status != "ok")
    finally:
        progress.clear()
        write_tables(study, journal)


def _on_dask(study: StudyFile, text: str, numbers: Sequence[int], address: str) -> Iterator[Outcome]:
    from pymoos_lite.hosts.study_workers import DaskMissingError, run_on_dask
    from pymoos_lite.tools.mission import MissionError

    try:
        yield from run_on_dask(text, study.file, numbers, address)
    except (DaskMissingError, OSError, ValueError) as error:
        raise MissionError(f"--dask {address}: {error}") from None


def _tell(study: StudyFile, journal: Journal) -> int:
    from pymoos_lite.hosts.study_journal import finished, write_tables
    from pymoos_lite.hosts.study_summary import summary_lines

    files = write_tables(study, journal)
    results = list(finished(study, journal))
    lines = summary_lines(study, results)
    (journal.folder / "summary.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))
    print("\nresults in " + ", ".join(map(str, files)))
    return 1 if any(outcome.status != "ok" for _, outcome in results) else 0


def _again(study: StudyFile, number: int, out: Path) -> int:
    """One row with all its logs, compared with what the study found."""
    from pymoos_lite.hosts.study import run_row
    from pymoos_lite.hosts.study_journal import Journal
    from pymoos_lite.tools.mission import MissionError

    try:
        row = study.row(number)
    except KeyError:
        raise MissionError(f"--row {number}: the study has rows 1 to {study.row_count}") from None
    folder = out / f"row_{number}"
    outcome = run_row(study, row, folder)
    for column, value in outcome.values.items():
        print(f"{column:<24} {'-' if value is None else f'{value:.10g}'}")
    print(f"row {number}: {outcome.status}; logs in {folder}")
    journal_file = out / "journal.jsonl"
    if outcome.status == "ok" and journal_file.exists():
        journal = Journal(out, Path(study.file).read_text(encoding="utf-8"))
        journal.close()
        former = journal.outcomes.get(number)
        if former is not None and former.status == "ok":
            equal = dict(former.values) == dict(outcome.values)
            print(
                f"row {number}: " + ("the same as in the study" if equal else "NOT the same as in the study")
            )
            return 0 if equal else 1
    return 0 if outcome.status == "ok" else 1


class Progress:
    """Runs done, failed and to go, and the time left: a bar on a terminal, else a line now and then."""

    def __init__(self, total: int, quiet: bool = False) -> None:
        self._total, self._quiet = total, quiet or total == 0
        self._done = self._failed = 0
        self._began = self._told = time.perf_counter()
        self._bar = sys.stderr.isatty()
        if not self._quiet:
            self._show()

    def one(self, failed: bool) -> None:
        """Another run is done."""
        self._done += 1
        self._failed += failed
        now = time.perf_counter()
        if not self._quiet and (self._bar or now - self._told >= TELL_PERIOD):
            self._told = now
            self._show()

    def _show(self) -> None:
        text = progress_text(self._done, self._total, self._failed, time.perf_counter() - self._began)
        if self._bar:
            print(f"\r{text}", end="", file=sys.stderr, flush=True)
        elif self._done:
            print(text, file=sys.stderr, flush=True)

    def clear(self) -> None:
        if self._bar and not self._quiet:
            print("\r" + " " * 79 + "\r", end="", file=sys.stderr, flush=True)


def progress_text(done: int, total: int, failed: int, seconds: float) -> str:
    """One line of at most 79 characters."""
    width = 24
    full = width * done // max(total, 1)
    left = seconds / done * (total - done) if done else 0.0
    ahead = f"{left / 3600:.0f} h {left % 3600 / 60:02.0f} min" if left >= 3600 else f"{left / 60:.0f} min"
    text = f"[{'#' * full}{'.' * (width - full)}] {done} of {total}"
    text += f", {failed} failed" if failed else ""
    return text + (f", {ahead} left" if done and done < total else "")
