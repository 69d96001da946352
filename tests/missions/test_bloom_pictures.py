"""Figures of the bloom mission: what is read from logs, and that every picture holds what it should."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from missions.bloom.comparison import commitment, compare_figure
from missions.bloom.pictures import (
    NONE_COLOUR,
    Curve,
    animate,
    coalitions_figure,
    curves,
    sheet_figure,
    snapshot_figure,
    study_figure,
)
from missions.bloom.run_log import read_run
from opinion_engine.model import OpinionError
from pymoos_lite.tools import cli
from pymoos_lite.tools.log_reading import LogError

HEADER = """%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%
%% LOG FILE:       x
%% FILE OPENED ON  Thu Jan  1 00:00:00 2026
%% LOGSTART           0.00
%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%%
"""


def line(time, name, value):
    return f"{time:<15.5f} {name:<20} app            {value}\n"


def vessel_log(name, x, options, migrate_from):
    text = HEADER
    for second in range(121):
        z = 100.0 if second >= migrate_from else 0.5
        opinion = f"{name}:leader:explore={-z / 2:.4f}:exploit={-z / 2:.4f}:migrate={z:.4f}"
        text += line(second, "NAV_X", x + second) + line(second, "NAV_Y", -300.0)
        text += line(second, "NAV_HEADING", 90.0) + line(second, "OWN_OPINION_STATE", opinion)
        text += line(second, "OWN_ATTENTION", 2.0 if second >= migrate_from else 0.5)
        text += line(second, "CONTACTS_LIST", "ben" if name == "abe" else "abe")
        if second in options:
            text += line(second, "OPTION", options[second])
    return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Logs of two vessels and a shoreside, written by hand."""
    root = tmp_path_factory.mktemp("logs")
    logs = {
        "LOG_ABE_1": vessel_log("abe", -200.0, {10: "EXPLORE", 60: "MIGRATE"}, 60),
        "LOG_BEN_1": vessel_log("ben", -100.0, {10: "EXPLORE", 40: "EXPLOIT", 80: "MIGRATE"}, 80),
        "XLOG_SHORESIDE_1": HEADER
        + line(5, "VIEW_CIRCLE", "x=-150,y=-300,radius=10,label=Bloom_1,edge_color=red")
        + line(50, "VIEW_CIRCLE", "x=-150,y=-300,radius=30,label=Bloom_1,edge_color=limegreen")
        + line(60, "VIEW_CIRCLE", "x=0,y=0,radius=180,label=storm,edge_color=dodger_blue")
        + line(100, "VIEW_CIRCLE", "x=0,y=0,label=Bloom_1,active=false,radius=0")
        + line(20, "VIEW_CIRCLE", "x=1,y=1,radius=6,label=abe's opt_circ")
        + line(101, "VIEW_CIRCLE", "nonsense"),
    }
    for name, text in logs.items():
        (root / name).mkdir()
        (root / name / f"{name}.alog").write_text(text)
    return root


def test_a_run_is_read_into_arrays_over_a_common_clock(folder):
    run = read_run(folder)
    assert run.names == ("abe", "ben")
    assert run.opinions.options == ("explore", "exploit", "migrate")
    k = run.index(50.0)
    assert run.t[k] == 50.0
    assert (run.x[k].tolist(), run.y[k].tolist()) == ([-150.0, -50.0], [-300.0, -300.0])
    assert run.option[[5, 20, 50, 90]].tolist() == [[-1, -1], [0, 0], [0, 1], [2, 2]]
    assert run.opinions.u[90].tolist() == [2.0, 2.0]
    assert run.opinions.degree[90].tolist() == [1.0, 1.0]


def test_circles_are_those_of_the_moment(folder):
    run = read_run(folder)
    assert run.circles_at(4.0) == {}
    assert run.circles_at(30.0)["Bloom_1"].radius == 10.0
    assert {label: c.attributes.edge_color for label, c in run.circles_at(70.0).items()} == {
        "Bloom_1": "limegreen",
        "storm": "dodger_blue",
    }
    assert list(run.circles_at(110.0)) == ["storm"]


def test_a_folder_without_logs_is_refused(tmp_path):
    with pytest.raises(LogError, match="no vessel's log"):
        read_run(tmp_path)


def test_the_snapshot_links_those_who_hear_each_other_and_shows_the_sea(folder):
    run = read_run(folder)
    near, far = (snapshot_figure(run, 50.0, comms_range) for comms_range in (160.0, 50.0))

    def links(made):
        return [artist for artist in made.axes[0].lines if artist.get_color() == "#D62728"]

    assert len(links(near)) == 1
    assert links(near)[0].get_xdata().tolist() == [-150.0, -50.0]
    assert links(far) == []
    circles = [p for p in near.axes[0].patches if type(p).__name__ == "Circle"]
    assert [(c.center, c.radius) for c in circles] == [((-150.0, -300.0), 30.0)]
    assert {text.get_text() for text in near.axes[0].texts} == {"X-ray", "Yankee", "abe", "ben"}


def test_coalitions_are_strips_that_change_colour_where_the_option_changes(folder):
    made = coalitions_figure(read_run(folder))
    bars = [(round(60 * p.get_x()), round(60 * p.get_width())) for p in made.axes[0].patches]
    assert bars == [(0, 10), (10, 50), (60, 60), (0, 10), (10, 30), (40, 40), (80, 40)]


def test_a_vessel_out_of_action_follows_no_option_and_is_linked_to_nobody(folder, tmp_path):
    logs = {path.name: (path / f"{path.name}.alog").read_text() for path in folder.iterdir()}
    logs["LOG_BEN_1"] += "".join(
        line(t, "MODE", mode)
        for t, mode in [
            (0, "INACTIVE"),
            (12, "ACTIVE:EXPLORING"),
            (70, "INACTIVE"),
            (100, "ACTIVE:RETURNING"),
        ]
    ) + line(70, "CONTACTS_LIST", "")
    logs["LOG_BEN_1"] = "".join(
        text
        for text in logs["LOG_BEN_1"].splitlines(keepends=True)
        if "CONTACTS_LIST" not in text or float(text.split()[0]) <= 70
    )
    for name, text in logs.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.alog").write_text(text)
    run = read_run(tmp_path)
    assert run.option[[5, 11, 12, 69, 70, 90, 110], 1].tolist() == [-1, -1, 0, 1, -1, -1, -1]
    colours = [p.get_facecolor() for p in coalitions_figure(run).axes[0].patches]
    assert to_rgba(NONE_COLOUR) in colours
    links = [
        sum(a.get_color() == "#D62728" for a in snapshot_figure(run, second).axes[0].lines)
        for second in (60, 90)
    ]
    assert links == [1, 0]


def test_a_contact_sheet_has_a_panel_for_every_moment(folder):
    made = sheet_figure(read_run(folder), [10.0, 50.0, 70.0, 110.0])
    assert [axis.get_title("left") for axis in made.axes if axis.get_title("left")] == [
        "0 min", "1 min", "1 min", "2 min",
    ]  # fmt: skip
    discs = [sum(type(p).__name__ == "Circle" for p in axis.patches) for axis in made.axes]
    assert discs == [1, 1, 2, 1, 0, 0], "blooms and storm of the moment"
    with pytest.raises(ValueError, match="at least one"):
        sheet_figure(read_run(folder), [])


def test_runs_are_compared_by_how_their_vessels_commit(folder, tmp_path, monkeypatch, capsys):
    run = read_run(folder)
    t = np.arange(601.0)
    wave = np.where(t[:, None] < 300.0, 1.0, -1.0) * np.array([1.0, 2.0])
    z = np.stack([-wave, wave, 0.0 * wave], axis=-1)
    z[:60] = 0.0
    samples = np.repeat(t[:, None] // 100, 2, axis=1).astype(np.int64)
    opinions = replace(run.opinions, t=t, z=z)
    made_up = replace(run, t=t, option=(wave < 0.0).astype(np.int64), samples=samples, opinions=opinions)
    found = commitment(made_up, 0.0)
    assert found.changes == pytest.approx(1.0)
    assert found.deadlock == pytest.approx(60 / 601)
    assert found.apart == pytest.approx(3.0 * 541 / 601)
    assert found.strength == pytest.approx(1.5 * np.sqrt(2.0) * 541 / 601)
    assert found.samples == 12
    assert commitment(made_up, 60.0).deadlock == 0.0
    made = compare_figure(["one", "two"], [made_up, run], 0.0)
    assert [axis.get_title() for axis in made.axes[:2]] == ["one", "two"]
    for axis in made.axes[2:]:
        assert sum(patch.get_height() for patch in axis.patches) == pytest.approx(100.0)
    with pytest.raises(OpinionError, match="ends at 600 s"):
        commitment(made_up, 600.0)
    monkeypatch.chdir(tmp_path)
    assert cli.main(["bloom", "compare", str(folder), str(folder), "--names", "a,b", "--from", "0.5"]) == 0
    assert (tmp_path / "compare.png").exists()
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[:3]] == ["run", "a", "b"]
    assert cli.main(["bloom", "compare", str(folder), "--names", "a,b"]) == 1


def test_the_animation_has_a_frame_for_every_step(folder, tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / "run.gif"
    assert animate(read_run(folder), str(path), step=40.0) == 4
    with image.open(path) as film:
        assert film.n_frames == 4
        first = np.asarray(film.convert("RGB"))
        film.seek(3)
        assert (np.asarray(film.convert("RGB")) != first).any()


ROWS = [
    {
        "vehicles": str(n),
        "method": m,
        "seed": str(s),
        "status": "ok",
        "percent_sampled": str(v),
        "samples_per_km": "1",
    }
    for n, m, s, v in [(4, "gcid", 1, 10), (4, "gcid", 2, 30), (8, "gcid", 1, 50), (4, "static", 1, 5)]
] + [{"vehicles": "8", "method": "gcid", "seed": "2", "status": "failed: x", "percent_sampled": "99"}]


def test_the_study_s_curves_are_means_with_least_and_most_over_the_seeds():
    assert curves(ROWS, "percent_sampled") == [
        Curve("gcid", (4, 8), (20.0, 50.0), (10.0, 50.0), (30.0, 50.0), 3),
        Curve("static", (4,), (5.0,), (5.0,), (5.0,), 1),
    ]
    made = study_figure(ROWS)
    labels = [line.get_label() for line in made.axes[0].lines]
    assert [label for label in labels if not label.startswith("_")] == ["gcid", "static"]
    assert len(labels) == 6, "each with its least and most"
    assert made.axes[1].get_xticks().tolist() == [4, 8], "the sizes of all methods"
    assert made.legends[0].get_title().get_text().startswith("4 runs")
    with pytest.raises(ValueError, match="no finished run"):
        study_figure([])


def test_every_figure_is_one_command_and_two_files(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["bloom", "figures", str(folder), "--at", "1", "--out", "made"]) == 0
    names = {path.name for path in (tmp_path / "made").iterdir()}
    assert names == {
        f"{n}.{e}" for n in ("snapshot", "simplex", "attention", "coalitions") for e in ("png", "svg")
    }
    assert cli.main(["bloom", "snapshot", str(folder), "--out", "one.pdf"]) == 0
    assert (tmp_path / "one.pdf").read_bytes().startswith(b"%PDF")
    with (tmp_path / "results.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(ROWS[0]))
        writer.writeheader()
        writer.writerows({key: row.get(key, "") for key in ROWS[0]} for row in ROWS)
    assert cli.main(["bloom", "study", "results.csv"]) == 0
    assert (tmp_path / "study.svg").exists()
    assert cli.main(["bloom", "sheet", str(folder), "--minutes", "0.5,1.5"]) == 0
    assert (tmp_path / "sheet.png").exists()
    assert cli.main(["bloom", "study", "nowhere.csv"]) == 1
    assert cli.main(["bloom", "simplex", str(tmp_path / "made")]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 2


@pytest.mark.parametrize("name", ["framework", "engine"])
def test_the_drawings_are_one_command_each(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["bloom", name]) == 0
    assert (tmp_path / f"{name}.svg").read_text().count("<path") > 20
    assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
