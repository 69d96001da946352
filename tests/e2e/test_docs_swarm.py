"""What docs/swarm.md tells a researcher to do, done."""

import re
import shutil
import textwrap
from pathlib import Path

import pytest

import missions
from pymoos_lite.config.study_file import parse_study
from pymoos_lite.hosts.study import plan_row
from pymoos_lite.tools import cli

PAGE = Path(missions.__file__).parents[1] / "docs" / "swarm.md"
BLOOM = Path(missions.__file__).parent / "bloom"


@pytest.fixture
def mybloom(tmp_path, monkeypatch):
    """A copy of the mission in an empty folder, which is the current one."""
    shutil.copytree(BLOOM, tmp_path / "mybloom", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "mybloom"


@pytest.fixture(scope="module")
def page():
    if not PAGE.exists():
        pytest.skip("the documentation is not installed")
    return PAGE.read_text()


def test_a_copied_mission_passes_the_check_and_sails(mybloom, capsys):
    assert cli.main(["check", "mybloom", "--strict", "--vehicles", "2"]) == 0
    words = ["sim", "mybloom", "--vehicles", "2", "--duration", "25", "--macro", "LOGGING=lean"]
    assert (
        cli.main(
            [
                *words,
                "--log-dir",
                "logs/one",
                "--preset",
                "field",
                "--preset",
                "as_configured",
                "--no-progress",
            ]
        )
        == 0
    )
    assert "2 vehicles, 25 mission seconds" in capsys.readouterr().out


def test_a_changed_coupling_reaches_the_vessels(mybloom):
    file = mybloom / "bloom.opt"
    text = file.read_text()
    assert text.count("intra_agent_same_option_coupling = 1.0") == 3
    file.write_text(
        text.replace("intra_agent_same_option_coupling = 1.0", "intra_agent_same_option_coupling = 0.7")
    )
    from pymoos_lite.hosts.fleet import add_fleet, find_fleet, load_fleet, plan_fleet
    from pymoos_lite.hosts.lockstep import Lockstep

    plan = plan_fleet(
        load_fleet(find_fleet("mybloom"), 1, 1, ["quiet"]), mybloom, mybloom.parent / "out", warp=1.0
    )
    host = Lockstep(1, None, stagger=True)
    add_fleet(host, plan)
    options = host.communities["abe"].app("pOpinionManager").engine.options
    assert [option.alpha for option in options.options] == [0.7, 0.7, 0.7]


def test_the_prediction_s_lines_are_those_of_the_page(mybloom, page, capsys):
    for name in ("bloom.opt", "bloom_as_configured.opt"):
        words = [
            "opinion",
            "design",
            f"mybloom/{name}",
            "--mission",
            "mybloom/meta_vehicle.moos",
            "--u-th",
            "2000",
        ]
        assert cli.main([*words, "--bias", "explore=50"]) == 0
    said = capsys.readouterr().out
    lines = re.findall(r"^ {4}alpha [\d.]+: +(explore against exploit.*)$", page, re.MULTILINE)
    assert len(lines) == 2
    for line in lines:
        assert line in said


def test_the_study_of_the_page_is_sound_and_its_rows_can_be_planned(mybloom, page):
    (block,) = re.findall(r"(?:^ {4}.*\n|^\n)*^ {4}study: alpha\n(?:^ {4}.*\n|^\n)*", page, re.MULTILINE)
    study = parse_study(textwrap.dedent(block).strip() + "\n", str(mybloom.parent / "alpha.yaml"))
    assert study.problems == ()
    assert study.row_count == 40
    plan, duration = plan_row(study, study.row(40), mybloom.parent / "plan")
    assert duration == 7200.0
    assert len(plan.fleet.vehicles) == 8
    assert plan.fleet.vehicles[0].macros["OPTIONS"] == "bloom_as_configured.opt"


def test_the_sensitivity_study_changes_one_setting_at_a_time_and_every_point_can_be_planned(tmp_path):
    path = BLOOM / "sensitivity.yaml"
    study = parse_study(path.read_text(), str(path))
    assert study.problems == ()
    points = {}
    for row in study.rows():
        points.setdefault(row.factors, row)
        assert len([name for name, _ in row.factors if name != "method"]) == 1
    assert study.row_count == len(points) * len(study.seeds)
    for factors, row in points.items():
        plan, _ = plan_row(study, row, tmp_path / str(row.number))
        assert plan.problems == ()
        macros = plan.fleet.vehicles[0].macros
        assert all(macros[name] == value for name, value in factors if name.isupper())
        assert macros["METHOD"] == dict(factors)["method"]


def test_the_shipped_study_is_the_paper_s():
    path = BLOOM / "study.yaml"
    study = parse_study(path.read_text(), str(path))
    assert study.problems == ()
    assert study.row_count == 450
    assert study.factors == ("vehicles", "method")
    assert {row.seed for row in study.rows()} == set(range(1, 51))
