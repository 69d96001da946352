"""``pymoos bloom``: pictures and numbers of the bloom mission, from a run's logs or a study's results."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from missions.bloom.run_log import RunLog

FROM_RUN = {
    "snapshot": "the sea at a moment: zones, blooms, storm, vessels, who hears whom",
    "simplex": "every vessel's opinions on the simplex of the three options",
    "attention": "attention and number of contacts over time",
    "coalitions": "what each vessel did over time",
}

DRAWINGS = {
    "framework": "a drawing of how a fleet decides",
    "engine": "a drawing of one opinion engine",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    commands = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    for name, text in FROM_RUN.items():
        one = commands.add_parser(name, help=text)
        _run_arguments(one)
        _out_argument(one, f"{name}.png and {name}.svg")
    every = commands.add_parser("figures", help="all of these into one folder")
    _run_arguments(every)
    every.add_argument("--out", type=Path, default=Path("figures"), metavar="DIR", help="default figures")
    sheet = commands.add_parser("sheet", help="a contact sheet: the sea at several moments")
    _run_arguments(sheet)
    sheet.add_argument(
        "--minutes", type=_minutes, metavar="M,M,...", help="which moments (default six, evenly spaced)"
    )
    _out_argument(sheet, "sheet.png and sheet.svg")
    beside = commands.add_parser("compare", help="runs beside each other: who commits, who wavers")
    beside.add_argument(
        "runs", type=Path, nargs="+", metavar="LOGS", help="folders with the logs of a run each"
    )
    beside.add_argument(
        "--names", metavar="A,B,...", help="what to call the runs (default: their folders' names)"
    )
    beside.add_argument(
        "--from",
        dest="begin",
        type=float,
        default=0.0,
        metavar="MIN",
        help="first minute looked at (default 0)",
    )
    _out_argument(beside, "compare.png and compare.svg")
    film = commands.add_parser("animation", help="map, simplex and attention side by side, as a GIF")
    _run_arguments(film)
    film.add_argument(
        "--step", type=float, default=20.0, metavar="S", help="seconds between frames (default 20)"
    )
    film.add_argument("--out", type=Path, default=Path("bloom.gif"), metavar="FILE", help="default bloom.gif")
    close = commands.add_parser("encounters", help="who came too close to whom, and why")
    close.add_argument(
        "runs",
        nargs="+",
        type=Path,
        metavar="LOGS",
        help="folders, each with the logs of a run (sim's --log-dir)",
    )
    census = commands.add_parser(
        "census", help="a study's collisions by cause; runs that had some are sailed again, with logs"
    )
    census.add_argument("results", type=Path, metavar="RESULTS", help="folder with the results of a study")
    census.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: one for each processor)"
    )
    census.add_argument("--summary", action="store_true", help="print what was found, and sail nothing")
    study = commands.add_parser("study", help="what a study found, against the size of the fleet")
    study.add_argument("results", type=Path, metavar="RESULTS", help="results.csv of a study, or its folder")
    _out_argument(study, "study.png and study.svg")
    for name, text in DRAWINGS.items():
        _out_argument(commands.add_parser(name, help=text), f"{name}.png and {name}.svg")


def _run_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "logs", type=Path, metavar="LOGS", help="folder with the logs of a run (sim's --log-dir)"
    )
    parser.add_argument(
        "--at", type=float, default=50.0, metavar="MIN", help="minute of the snapshot (default 50)"
    )
    parser.add_argument(
        "--comms-range", type=float, default=160.0, metavar="M", help="as in the run (default 160)"
    )


def _minutes(text: str) -> list[float]:
    return [float(word) for word in text.split(",")]


def _out_argument(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument("--out", type=Path, metavar="FILE", help=f"image to write (default {default})")


def run(args: argparse.Namespace) -> int:
    from opinion_engine.model import OpinionError
    from pymoos_lite.tools.log_reading import LogError

    try:
        if args.what == "study":
            _write(_study(args.results), args.out, "study")
            return 0
        if args.what in DRAWINGS:
            from missions.bloom import diagrams

            made = diagrams.framework_figure() if args.what == "framework" else diagrams.engine_figure()
            _write(made, args.out, args.what)
            return 0
        if args.what == "census":
            return _census(args)
        if args.what == "encounters":
            from missions.bloom.encounters import encounter_lines, read_encounters

            print("\n".join(encounter_lines({str(folder): read_encounters(folder) for folder in args.runs})))
            return 0
        from missions.bloom.run_log import read_run

        if args.what == "compare":
            from missions.bloom.comparison import commitment_lines, compare_figure

            names = args.names.split(",") if args.names else [folder.name for folder in args.runs]
            if len(names) != len(args.runs):
                raise ValueError(f"--names: {len(names)} names for {len(args.runs)} runs")
            runs = [read_run(folder) for folder in args.runs]
            print("\n".join(commitment_lines(names, runs, 60.0 * args.begin)))
            _write(compare_figure(names, runs, 60.0 * args.begin), args.out, args.what)
            return 0
        history = read_run(args.logs)
        if args.what == "animation":
            from missions.bloom.pictures import animate

            frames = animate(history, str(args.out), args.step, args.comms_range)
            print(f"{args.out}: {frames} frames")
        elif args.what == "sheet":
            from missions.bloom.pictures import sheet_figure

            end = float(history.t[-1])
            moments = [60.0 * m for m in args.minutes or ()] or [end * (2 * k + 1) / 12.0 for k in range(6)]
            _write(sheet_figure(history, moments, args.comms_range), args.out, args.what)
        elif args.what == "figures":
            args.out.mkdir(parents=True, exist_ok=True)
            for name in FROM_RUN:
                _write(_draw(name, history, args), None, str(args.out / name))
        else:
            _write(_draw(args.what, history, args), args.out, args.what)
    except (LogError, OpinionError) as error:
        print(error, file=sys.stderr)
        return 1
    except (OSError, ValueError) as error:
        print(f"pymoos bloom: {error}", file=sys.stderr)
        return 1
    return 0


def _draw(name: str, history: RunLog, args: argparse.Namespace) -> Figure:
    from missions.bloom import pictures
    from opinion_engine import plots

    opinions = history.opinions
    if name == "snapshot":
        return pictures.snapshot_figure(history, 60.0 * args.at, args.comms_range)
    if name == "simplex":
        return plots.simplex_figure(opinions.z, opinions.names, opinions.options)
    if name == "attention":
        return plots.attention_figure(opinions.t, opinions.u, opinions.degree, opinions.names)
    return pictures.coalitions_figure(history)


def _study(path: Path) -> Figure:
    import csv

    from missions.bloom.pictures import study_figure

    file = path / "results.csv" if path.is_dir() else path
    with file.open(encoding="utf-8", newline="") as lines:
        rows: list[Mapping[str, str]] = list(csv.DictReader(lines))
    return study_figure(rows)


def _census(args: argparse.Namespace) -> int:
    from missions.bloom.census import Census
    from pymoos_lite.hosts.study_journal import JournalError
    from pymoos_lite.hosts.study_workers import default_workers
    from pymoos_lite.tools.monte import Progress, stoppable

    workers = args.workers if args.workers is not None else default_workers()
    if workers < 1:
        raise ValueError(f"--workers {workers}: expected at least 1")
    try:
        census = Census(args.results)
    except JournalError as error:
        print(error, file=sys.stderr)
        return 1
    failed = []
    numbers = [] if args.summary else census.to_look_at()
    if numbers:
        progress = Progress(len(numbers))
        try:
            with stoppable():
                for problem in census.look(min(workers, len(numbers))):
                    progress.one(bool(problem))
                    failed += [problem] * bool(problem)
        finally:
            progress.clear()
    print("\n".join(census.lines()))
    for problem in failed:
        print(problem, file=sys.stderr)
    return 1 if failed else 0


def _write(made: Figure, out: Path | None, name: str) -> None:
    for path in [out] if out is not None else [Path(f"{name}.png"), Path(f"{name}.svg")]:
        made.savefig(path)
        print(path)
