"""The census of a study's collisions: what is sailed again, what is written down, and what is not believed."""

import json
import shutil

import pytest

from missions.bloom.census import Census
from pymoos_lite.config.study_file import parse_study
from pymoos_lite.hosts.study_journal import Journal, fingerprint
from pymoos_lite.hosts.study_workers import run_here
from pymoos_lite.tools import cli

# Eight vessels that set out at once; with seed 3 two of them meet half a minute later.
STUDY = """
study: starts
mission: bloom
duration: 60
presets: [paper, quiet]
seeds: [3, 5]
grid:
  vehicles: [8]
  method: [static]
measure:
  collisions: shoreside COLLISION_TOTAL or 0
  closest: shoreside UCD_CLOSEST_RANGE_EVER
row_macros: {LOGGING: full}
"""


@pytest.fixture(scope="module")
def sailed(tmp_path_factory):
    """The results of that study."""
    folder = tmp_path_factory.mktemp("results")
    journal = Journal(folder, STUDY)
    assert parse_study(STUDY, "").problems == ()
    for outcome in run_here(STUDY, str(folder / "study.yaml"), (1, 2)):
        assert outcome.status == "ok"
        journal.add(outcome)
    journal.close()
    return folder


@pytest.fixture
def results(sailed, tmp_path):
    shutil.copytree(sailed, tmp_path / "results")
    return tmp_path / "results"


@pytest.mark.slow
def test_runs_with_collisions_are_sailed_again_once_and_told_by_cause(results, capsys):
    assert Census(results).to_look_at() == [1]
    assert cli.main(["bloom", "census", str(results), "--workers", "1"]) == 0
    first = capsys.readouterr().out
    lines = [line.split() for line in first.splitlines()]
    assert lines[0] == ["static"]
    assert ["turning", "1", "with", "avoidance"] in [line[:4] for line in lines]
    assert ["unseen", "0", "not", "looked", "at", "yet"] in lines
    assert lines[-2:] == [["runs", "2"], ["of", "them", "1", "had", "collisions"]]
    kept = (results / "encounters.csv").read_text().splitlines()
    assert kept[1] == "1,static,8,3,30.8,collision,1.32,cal,gil,exploiting,exploiting,turning"
    assert Census(results).to_look_at() == []
    assert cli.main(["bloom", "census", str(results), "--summary"]) == 0
    assert capsys.readouterr().out == first


@pytest.mark.slow
def test_a_run_that_comes_out_otherwise_is_not_counted(results, capsys):
    journal = results / "journal.jsonl"
    head, *rows = journal.read_text().splitlines()
    changed = [json.loads(row) for row in rows]
    changed[0]["values"]["closest"] += 0.5
    journal.write_text("\n".join([head, *map(json.dumps, changed)]) + "\n")
    assert cli.main(["bloom", "census", str(results), "--workers", "1"]) == 1
    told = capsys.readouterr()
    assert told.err.splitlines()[-1] == "row 1: not the run of the study (another version?)"
    assert ["unseen", "1"] in [line.split()[:2] for line in told.out.splitlines()]


def write_results(folder, collisions):
    folder.mkdir()
    (folder / "study.yaml").write_text(STUDY)
    lines = [{"study": fingerprint(STUDY)}]
    lines += [
        {"row": row, "status": "ok", "values": {"collisions": count, "closest": 1.0}}
        for row, count in enumerate(collisions, 1)
    ]
    (folder / "journal.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return folder


def test_what_a_stop_has_cut_off_is_looked_at_again(tmp_path):
    folder = write_results(tmp_path / "r", [2.0, 1.0])
    head = "row,method,vehicles,seed,time,rank,cpa,one,other,one_doing,other_doing,cause\n"
    line = "{},static,8,3,31.0,{},1.32,gil,cal,exploiting,exploiting,turning\n"
    whole = line.format(2, "collision") + line.format(2, "near_miss")
    (folder / "encounters.csv").write_text(head + line.format(1, "collision") + whole)
    census = Census(folder)
    assert census.to_look_at() == [1]
    (folder / "encounters.csv").write_text(head + line.format(1, "collision") * 2 + whole + "2,static,8")
    census = Census(folder)
    assert census.to_look_at() == []
    assert [line.split()[:2] for line in census.lines() if line.startswith("turning")] == [["turning", "3"]]


def test_a_folder_without_such_results_is_refused(tmp_path, capsys):
    assert cli.main(["bloom", "census", str(tmp_path)]) == 1
    assert capsys.readouterr().err == f"{tmp_path / 'study.yaml'}: No such file or directory\n"
    (tmp_path / "study.yaml").write_text(STUDY.replace("collisions:", "bumps:"))
    (tmp_path / "journal.jsonl").write_text("{}\n")
    assert cli.main(["bloom", "census", str(tmp_path)]) == 1
    assert (
        capsys.readouterr().err == f"{tmp_path}: it takes the results of a study with a column 'collisions'\n"
    )
