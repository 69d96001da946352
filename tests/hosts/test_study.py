"""Studies: rows, workers that die, journals that are cut off, tables, paired statistics."""

import csv
import json
import math
import random
import subprocess
import sys

import pytest
from scipy import stats
from study_fixture import STUDY, write_study

from pymoos_lite.config.study_file import Comparison, Row, parse_study
from pymoos_lite.hosts.study import Outcome, plan_row, run_row
from pymoos_lite.hosts.study_journal import Journal, JournalError, finished, table_text, write_tables
from pymoos_lite.hosts.study_summary import grid_cells, paired, summary_lines, watched_lines
from pymoos_lite.hosts.study_workers import ProcessWorkers, run_here
from pymoos_lite.tools import cli


@pytest.fixture
def dice(tmp_path):
    """A study file, its text, and the study."""
    path = write_study(tmp_path)
    study = parse_study(path.read_text(), str(path))
    assert study.problems == ()
    return path, study


def everything(path, numbers, workers):
    text = path.read_text()
    outcomes = (
        run_here(text, str(path), numbers)
        if workers == 0
        else ProcessWorkers(text, str(path), workers).run(numbers)
    )
    return {outcome.row: outcome for outcome in outcomes}


def plain(outcomes):
    return {number: (o.status, dict(o.values)) for number, o in outcomes.items()}


# --- one run ----------------------------------------------------------------------------------------------


def test_a_row_has_every_column_measured_and_derived(dice):
    _, study = dice
    outcome = run_row(study, study.row(9))
    assert outcome.status == "ok"
    values = outcome.values
    assert study.row(9).factors == (("vehicles", "2"), ("method", "plain"))
    assert values["total"] == pytest.approx(2 * values["mean"])
    assert values["least"] <= values["mean"] <= values["most"] < 1.0
    assert values["throws"] == 5.0
    assert values["lucky"] == 1.0
    assert values["none"] is None
    assert values["zero"] == 0.0
    assert values["each"] == pytest.approx(values["mean"])
    assert values["nothing"] is None, "a division by zero is missing, not an error"


def test_presets_macros_and_the_number_of_vehicles_reach_the_run(dice):
    _, study = dice
    plain_row, loaded = run_row(study, study.row(1)), run_row(study, study.row(5))
    assert loaded.values["total"] == pytest.approx(plain_row.values["total"] + 1.0)


def test_an_app_that_fails_makes_the_row_fail_and_says_why(tmp_path):
    path = write_study(tmp_path, STUDY + "macros: {FAIL: shoreside}\n")
    study = parse_study(path.read_text(), str(path))
    outcome = run_row(study, study.row(1))
    assert outcome.status.startswith("failed: ")
    assert "rolled off the table" in outcome.status


def test_an_app_of_one_vessel_that_fails_makes_the_row_fail_and_names_the_vessel(tmp_path):
    plan, _ = plan_row(
        parse_study(STUDY, str(write_study(tmp_path))), Row(9, 1, (("vehicles", "2"),)), tmp_path
    )
    name = plan.fleet.vehicle_names()[1]
    path = write_study(tmp_path, STUDY + f"macros: {{FAIL: {name}}}\n")
    study = parse_study(path.read_text(), str(path))
    assert run_row(study, study.row(1)).status == "ok", "a fleet of one has no second vessel"
    assert run_row(study, study.row(9)).status.startswith(f"failed: pDice ({name}) failed in iteration")


@pytest.mark.parametrize(
    ("line", "replacement", "complaint"),
    [
        ('MOOS_NAME = "pDice"', 'MOOS_NAME = "pDice"\n    1 / 0', "division by zero"),
        (
            "def iterate(self):",
            "def iterate(self):\n        raise SystemError('hull breach')\n",
            "hull breach",
        ),
        ('self.notify("THROWS"', 'self.notify("THROWS", object())\n        self.notify("X"', "text or bytes"),
    ],
)
def test_whatever_goes_wrong_in_a_run_is_a_row_and_the_study_goes_on(tmp_path, line, replacement, complaint):
    path = write_study(tmp_path)
    plugin = tmp_path / "mission" / "dice.py"
    plugin.write_text(plugin.read_text().replace(line, replacement))
    outcomes = everything(path, [1, 2], 0)
    for number in (1, 2):
        assert outcomes[number].status.startswith("failed: ")
        assert complaint in outcomes[number].status
        assert "\n" not in outcomes[number].status


def test_a_fault_in_the_measuring_is_a_row_too(dice, monkeypatch):
    path, _ = dice

    def broken(*_):
        raise LookupError("no such gauge")

    monkeypatch.setattr("pymoos_lite.hosts.study.measured", broken)
    outcomes = everything(path, [1, 2], 0)
    assert "LookupError: no such gauge [" in outcomes[2].status
    assert set(outcomes[2].values.values()) == {None}


def test_a_mission_that_cannot_be_found_makes_the_row_fail(tmp_path):
    path = write_study(tmp_path, STUDY.replace("mission: mission", "mission: nowhere"))
    study = parse_study(path.read_text(), str(path))
    assert "nowhere" in run_row(study, study.row(1)).status


# --- workers ----------------------------------------------------------------------------------------------


def test_every_way_to_run_it_gives_the_same_numbers(dice):
    path, study = dice
    numbers = [row.number for row in study.rows()][4:12]
    here = plain(everything(path, numbers, 0))
    shuffled = numbers.copy()
    random.Random(1).shuffle(shuffled)
    assert here == plain(everything(path, shuffled, 0))
    assert here == plain(everything(path, shuffled, 3))
    assert len(here) == 8


def test_a_worker_that_dies_in_the_middle_loses_no_run(tmp_path):
    trap = tmp_path / "trap"
    path = write_study(tmp_path, STUDY + f"macros: {{TRAP: '{trap.as_posix()}'}}\n")
    numbers = range(1, 9)
    calm = plain(everything(path, numbers, 0))
    trap.write_text("")
    assert plain(everything(path, numbers, 2)) == calm
    assert not trap.exists(), "somebody did step into it"


def test_a_worker_killed_from_outside_loses_no_run(tmp_path):
    import os
    import signal

    path = write_study(tmp_path, STUDY + "macros: {NAP: 0.02}\n")
    pool = ProcessWorkers(path.read_text(), str(path), 2)
    outcomes = {}
    for outcome in pool.run(range(1, 17)):
        outcomes[outcome.row] = outcome
        if len(outcomes) == 3:
            os.kill(pool.pids[0], getattr(signal, "SIGKILL", signal.SIGTERM))
    assert sorted(outcomes) == list(range(1, 17))
    assert {outcome.status for outcome in outcomes.values()} == {"ok"}


def test_a_row_that_kills_every_worker_fails_and_the_others_go_on(tmp_path):
    path = write_study(tmp_path, STUDY)
    plugin = tmp_path / "mission" / "dice.py"
    text = plugin.read_text().replace("time.sleep(self.config.nap)", "self.config.bonus == 1 and os._exit(9)")
    plugin.write_text(text)
    outcomes = everything(path, [1, 2, 5], 2)
    assert outcomes[5].status == "failed: its worker died 3 times"
    assert outcomes[1].status == outcomes[2].status == "ok"


def test_when_the_reader_stops_the_workers_are_gone(dice):
    path, _ = dice
    pool = ProcessWorkers(path.read_text(), str(path), 2)
    running = pool.run(range(1, 17))
    next(running)
    assert pool.pids
    running.close()
    assert pool.pids == []


# --- journal ----------------------------------------------------------------------------------------------


def test_a_study_goes_on_where_it_was_stopped(dice, capsys):
    path, _ = dice
    out = path.parent / "out"
    words = ["monte", str(path), "--out", str(out), "--workers", "1", "--no-progress"]
    assert cli.main([*words, "--rows", "1-5"]) == 0
    assert len((out / "results.csv").read_text().splitlines()) == 6
    stamp = (out / "journal.jsonl").read_text()
    assert cli.main(words) == 0
    assert (out / "journal.jsonl").read_text().startswith(stamp), "what was done is not done again"
    whole = (out / "results.csv").read_bytes()
    other = path.parent / "other"
    assert cli.main(["monte", str(path), "--out", str(other), "--workers", "1", "--no-progress"]) == 0
    assert (other / "results.csv").read_bytes() == whole
    assert "16 of 16 runs, 0 failed" in capsys.readouterr().out


def test_a_study_that_is_killed_in_the_middle_goes_on_to_the_same_table(tmp_path):
    trap = tmp_path / "trap"
    path = write_study(tmp_path, STUDY + f"macros: {{TRAP: '{trap.as_posix()}'}}\n")
    command = [sys.executable, "-m", "pymoos_lite.tools.cli", "monte", str(path), "--no-progress"]

    def monte(out, *more):
        done = subprocess.run(
            [*command, "--workers", "1", "--out", str(tmp_path / out), *more],
            capture_output=True, text=True, timeout=120, check=False,
        )  # fmt: skip
        return done.returncode, done.stderr

    assert monte("calm") == (0, "")
    assert monte("killed", "--rows", "1-3") == (0, "")
    trap.write_text("")  # the process ends at once in the next row, with nothing closed or told
    assert monte("killed")[0] == 9
    assert monte("killed") == (0, "dice: 3 runs are done already, 13 to go\n")
    for name in ("results.csv", "summary.txt"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "calm" / name).read_bytes()


def test_a_line_cut_off_by_a_crash_is_run_again(dice):
    path, study = dice
    out = path.parent / "out"
    text = path.read_text()
    journal = Journal(out, text)
    for outcome in everything(path, [1, 2, 3], 0).values():
        journal.add(outcome)
    journal.close()
    whole = table_text(study, journal)
    file = out / "journal.jsonl"
    file.write_text(file.read_text()[:-20])
    again = Journal(out, text)
    assert again.done() == {1, 2}
    assert again.damaged == 1
    for outcome in everything(path, [3], 0).values():
        again.add(outcome)
    again.close()
    last = Journal(out, text)
    last.close()
    assert table_text(study, last) == whole


def test_failed_rows_are_tried_again(dice):
    path, _ = dice
    journal = Journal(path.parent / "out", path.read_text())
    journal.add(Outcome(1, "failed: bad luck", {}))
    journal.add(Outcome(2, "ok", {}))
    assert journal.done() == {2}
    journal.close()


def test_the_results_of_another_study_are_never_mixed_in(dice):
    path, _ = dice
    Journal(path.parent / "out", path.read_text()).close()
    for old, new in (("count: 4", "count: 5"), ("total / vehicles", "total / seed"), ("[1, 2]", "[2, 1]")):
        changed = path.read_text().replace(old, new)
        assert changed != path.read_text()
        with pytest.raises(JournalError, match="another study"):
            Journal(path.parent / "out", changed)


def test_what_is_compared_or_watched_can_be_changed_afterwards(dice):
    path, study = dice
    journal = Journal(path.parent / "out", path.read_text())
    journal.add(run_row(study, study.row(1)))
    journal.close()
    for more in ("\n# a comment\n", "\nwatch: [throws]\n", "\nwatch: [zero]\n"):
        again = Journal(path.parent / "out", path.read_text() + more)
        again.close()
        assert again.done() == {1}


def test_the_table_can_be_read_as_csv_and_parquet_alike(dice):
    path, study = dice
    journal = Journal(path.parent / "out", path.read_text())
    for outcome in everything(path, [2, 1], 0).values():
        journal.add(outcome)
    files = write_tables(study, journal)
    journal.close()
    with files[0].open() as file:
        rows = list(csv.DictReader(file))
    assert [row["row"] for row in rows] == ["1", "2"]
    assert rows[0]["none"] == ""
    assert float(rows[0]["total"]) == journal.outcomes[1].values["total"], "to the last bit"
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(files[1]).to_pylist()
    assert [row["total"] for row in table] == [float(row["total"]) for row in rows]
    assert table[0]["none"] is None
    assert table[0]["method"] == "plain"


def test_a_single_row_run_again_is_compared_with_the_study(dice, capsys):
    path, _ = dice
    out = path.parent / "out"
    words = ["monte", str(path), "--out", str(out), "--workers", "1", "--no-progress"]
    assert cli.main([*words, "--rows", "1-3"]) == 0
    assert cli.main([*words, "--row", "3"]) == 0
    assert "row 3: the same as in the study" in capsys.readouterr().out
    file = out / "journal.jsonl"
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    lines[3]["values"]["total"] += 1.0
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert cli.main([*words, "--row", "3"]) == 1
    assert "NOT the same" in capsys.readouterr().out


def test_only_rows_with_the_wanted_values_are_run(dice):
    path, study = dice
    out = path.parent / "out"
    words = ["monte", str(path), "--out", str(out), "--workers", "1", "--no-progress"]
    assert cli.main([*words, "--where", "method=plain", "--where", "vehicles=2", "--rows", "2-16"]) == 0
    chosen = [r.number for r in study.rows() if r.factors == (("vehicles", "2"), ("method", "plain"))]
    with (out / "results.csv").open() as file:
        assert [int(line["row"]) for line in csv.DictReader(file)] == [n for n in chosen if n >= 2]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--row", "99"], "rows 1 to 16"),
        (["--row", "0"], "rows 1 to 16"),
        (["--rows", "5-99"], "rows 1 to 16"),
        (["--rows", "x"], "expected A-B"),
        (["--workers", "0"], "at least 1"),
        (["--where", "method"], "expected FACTOR=VALUE"),
        (["--where", "metod=plain"], "did you mean 'method'"),
        (["--where", "method=magic"], "no row has these values"),
    ],
)
def test_wrong_words_are_refused_in_one_line(dice, capsys, words, complaint):
    path, _ = dice
    assert cli.main(["monte", str(path), "--out", str(path.parent / "out"), *words]) == 1
    error = capsys.readouterr().err
    assert complaint in error
    assert len(error.splitlines()) == 1


# --- statistics -------------------------------------------------------------------------------------------


def made_up(count=20, shift=0.3, seed=3):
    """Rows and outcomes with a large common part per seed and a small difference between methods."""
    dice = random.Random(seed)
    results, number = [], 0
    for size in ("4", "8"):
        for run in range(1, count + 1):
            common = dice.gauss(0.0, 10.0)
            for method, extra in (("a", shift), ("b", 0.0)):
                number += 1
                row = Row(number, run, (("vehicles", size), ("method", method)))
                results.append((row, Outcome(number, "ok", {"y": common + extra + dice.gauss(0.0, 0.1)})))
    return results


def test_paired_differences_agree_with_scipy():
    results = made_up()
    pairs = paired(results, Comparison("y", "method", (("a", "b"),), ("vehicles",)))
    assert [dict(p.within)["vehicles"] for p in pairs] == ["4", "8"]
    for pair in pairs:
        size = dict(pair.within)["vehicles"]
        a, b = (
            [o.values["y"] for r, o in results if r.value("vehicles") == size and r.value("method") == m]
            for m in "ab"
        )
        test = stats.ttest_rel(a, b)
        assert pair.p_t == pytest.approx(test.pvalue)
        interval = test.confidence_interval(0.95)
        assert (pair.low, pair.high) == pytest.approx((interval.low, interval.high))
        assert pair.difference == pytest.approx(sum(a) / 20 - sum(b) / 20)
        assert pair.low > 0.0, "a difference of three tenths is found among seeds that differ by ten"
        assert pair.wins == sum(x > y for x, y in zip(a, b, strict=True))
        assert pair.p_wilcoxon == pytest.approx(stats.wilcoxon(a, b).pvalue)


def test_runs_without_a_partner_and_failed_ones_do_not_count():
    results = made_up(count=5)
    broken = [
        (row, Outcome(row.number, "failed: x", outcome.values) if row.number == 1 else outcome)
        for row, outcome in results
        if row.number != 4
    ]
    pairs = paired(broken, Comparison("y", "method", (("a", "b"),), ("vehicles",)))
    assert [pair.pairs for pair in pairs] == [3, 5]


def test_equal_results_give_no_interval_instead_of_nonsense():
    results = made_up(count=3)
    flat = [(row, Outcome(row.number, "ok", {"y": 1.0})) for row, _ in results]
    (pair, _) = paired(flat, Comparison("y", "method", (("a", "b"),), ("vehicles",)))
    assert (pair.low, pair.high, pair.p_t, pair.ties) == (None, None, None, 3)


def test_the_summary_names_the_rows_in_which_a_watched_column_is_not_zero():
    values = {1: 0.0, 2: 3.0, 3: 0.0, 4: 1.0, 5: None}
    results = [(Row(n, n, ()), Outcome(n, "ok", {"hits": value})) for n, value in values.items()]
    results.append((Row(6, 6, ()), Outcome(6, "failed: x", {"hits": 99.0})))
    head, rows = watched_lines("hits", results)
    assert head == "hits: 4 in all, not 0 in 2 of 4 runs; least 0 (row 1), most 3 (row 2)"
    assert rows == "  rows 2 (3), 4 (1)"
    (alone,) = watched_lines("hits", [results[0], results[2]])
    assert "not 0 in 0 of 2 runs" in alone
    many = [(Row(n, n, ()), Outcome(n, "ok", {"hits": float(n > 1)})) for n in range(1, 31)]
    assert watched_lines("hits", many)[1].endswith("21 (1) and 9 more")
    assert watched_lines("hits", results[4:5]) == ["hits: not measured in any run"]


def test_the_summary_tells_means_differences_and_failures(dice):
    path, study = dice
    journal = Journal(path.parent / "out", path.read_text())
    for outcome in everything(path, range(1, 17), 0).values():
        journal.add(outcome)
    journal.close()
    results = list(finished(study, journal))
    cells = {(c.factors, c.column): c for c in grid_cells(study, results)}
    cell = cells[(("vehicles", "1"), ("method", "plain")), "total"]
    expected = [outcome.values["total"] for row, outcome in results[:4]]
    assert cell.mean == pytest.approx(sum(expected) / 4)
    assert (cell.least, cell.most, cell.runs) == (min(expected), max(expected), 4)
    text = "\n".join(summary_lines(study, results))
    assert "loaded - plain: +1 [" in text or "loaded - plain: +1  " in text
    assert "higher in 4 of 4" in text
    results[0] = (results[0][0], Outcome(1, "failed: bad luck", {}))
    assert "1 failed" in summary_lines(study, results)[0]
    assert math.isfinite(cell.spread)
