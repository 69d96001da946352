"""`pymoos log ...` on small logs written here."""

from __future__ import annotations

import gzip

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.core.message import Message
from pymoos_lite.records.alog import AlogStyle, entry_printer, print_header, read_entries, read_lines
from pymoos_lite.tools.cli import main
from pymoos_lite.tools.log_plot import arrow_places, vessel_name
from pymoos_lite.tools.log_reading import Selection, find_log
from pymoos_lite.tools.log_scan import ordered, summarise
from pymoos_lite.tools.log_select import count_late, sorted_lines, without_repeats
from pymoos_lite.tools.log_series import Track, collect, unwrapped_gaps

POSTS = [
    ("NAV_X", 1.0, 0.5, "uSimMarine", ""),
    ("NAV_Y", 2.0, 0.5, "uSimMarine", ""),
    ("DEPLOY", "true", 1.0, "pHelmIvP", "1:HELM"),
    ("NODE_REPORT", "NAME=ben,X=5,Y=6,HDG=90,SPD=1,TIME=1", 2.0, "pShare", ""),
    ("PFOO_ITER_GAP", 1.01, 2.5, "pFoo", ""),
    ("NAV_X", 3.0, 1.5, "uSimMarine", ""),
    ("NAV_Y", 4.0, 1.5, "uSimMarine", ""),
    ("NAV_X", 3.0, 1.5, "uSimMarine", ""),
]


def log_text(posts=POSTS) -> str:
    entry = entry_printer(0.0, AlogStyle(aux=True))
    rows = [entry(Message(name, value, time, source, aux)) for name, value, time, source, aux in posts]
    return print_header("x", "Thu Jan  1 00:00:00 1970", 0.0) + "".join(rows)


@pytest.fixture
def log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "in.alog"
    path.write_text(log_text())
    return path


def names(text: str) -> list[str]:
    return [entry.name for entry in read_entries(text.splitlines())]


def grep(capsys, *words: str) -> str:
    assert main(["log", "grep", "in.alog", *words]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "kept"),
    [
        (["NAV_X"], ["NAV_X"] * 3),
        (["NAV_*"], ["NAV_X", "NAV_Y", "NAV_X", "NAV_Y", "NAV_X"]),
        (["pHelmIvP"], ["DEPLOY"]),
        (["pHelmIvP:1:HELM"], ["DEPLOY"]),
        (["pS*", "DEPLOY"], ["DEPLOY", "NODE_REPORT"]),
        (["pFoo"], []),
        (["pFoo", "-gl"], ["PFOO_ITER_GAP"]),
        (["PFOO_ITER_GAP"], ["PFOO_ITER_GAP"]),
        (["-s", "NAV_X"], ["NAV_X"] * 3),
        (["NAV_X", "-d"], ["NAV_X"] * 2),
        (["NAV_X", "--first"], ["NAV_X"]),
        (["NAV"], []),
    ],
)
def test_grep_keeps_entries_by_variable_or_app(log, capsys, words, kept):
    out = grep(capsys, *words)
    assert names(out) == kept
    assert out.startswith("%%%")


def test_kept_lines_are_unchanged_and_the_header_can_be_dropped(log, capsys):
    out = grep(capsys, "*", "-gl", "-nc")
    assert out == "".join(row for row in log.read_text().splitlines(keepends=True) if not row.startswith("%"))


@pytest.mark.parametrize(
    ("words", "rows"),
    [
        (["NAV_X", "--v"], ["1.00000", "3.00000", "3.00000"]),
        (["DEPLOY", "--tv"], ["1.00000 true"]),
        (["DEPLOY", "--tvv", "--csc"], ["1.00000,DEPLOY,true"]),
        (["DEPLOY", "--format=time:var:src", "--cso"], ["1.00000:DEPLOY:pHelmIvP:1:HELM"]),
        (["NAV_X", "--v", "--final"], ["3.00000"]),
        (["NAV_X", "--v", "--first", "--final"], ["1.00000", "3.00000"]),
        (["NODE_REPORT", "--subpat=X:NAME:NONE", "--csc"], ["5,ben"]),
        (["NODE_REPORT", "--subpat=X:Y", "--kk", "--tv"], ["2.00000 X=5 Y=6"]),
        (["DEPLOY", "--subpat=X", "--v"], []),
    ],
)
def test_grep_prints_columns(log, capsys, words, rows):
    assert grep(capsys, *words).splitlines() == rows


def test_output_goes_to_a_second_log_which_is_only_overwritten_by_force(log, capsys):
    assert main(["log", "grep", "in.alog", "NAV_X", "out.alog"]) == 0
    assert "3 of 8" in capsys.readouterr().out
    assert names((log.parent / "out.alog").read_text()) == ["NAV_X"] * 3
    assert main(["log", "grep", "in.alog", "NAV_Y", "out.alog"]) == 1
    assert "--force" in capsys.readouterr().err
    assert main(["log", "grep", "in.alog", "-f", "NAV_Y", "out.alog", "-q"]) == 0
    assert capsys.readouterr().out == ""
    assert names((log.parent / "out.alog").read_text()) == ["NAV_Y"] * 2
    assert main(["log", "grep", "in.alog", "NAV_Y", "./in.alog", "-f"]) == 1
    assert log.read_text() == log_text()


def test_malformed_lines_are_kept_only_on_request(log, capsys):
    log.write_text(log_text() + "garbage\n  more of it\n")
    assert "garbage" not in grep(capsys, "*")
    assert grep(capsys, "*", "-kb").endswith("garbage\n  more of it\n")


@pytest.mark.parametrize(
    ("words", "left"),
    [
        (["NAV_*"], ["DEPLOY", "NODE_REPORT", "PFOO_ITER_GAP"]),
        (["--nonum"], ["DEPLOY", "NODE_REPORT"]),
        (["--nostr", "uSimMarine"], ["PFOO_ITER_GAP"]),
    ],
)
def test_rm_is_the_other_half(log, capsys, words, left):
    assert main(["log", "rm", "in.alog", *words]) == 0
    assert names(capsys.readouterr().out) == left


def test_rm_cleans_out_what_is_no_entry(log, capsys):
    log.write_text("junk\n1.0 A app\n1.0 A app x\n")
    assert main(["log", "rm", "in.alog", "--clean"]) == 0
    assert capsys.readouterr().out == "1.0 A app x\n"


def test_clip_keeps_a_span_with_both_ends_and_can_name_its_output(log, capsys):
    assert main(["log", "clip", "in.alog", "2", "1", "-b", "--suffix=_x"]) == 0
    capsys.readouterr()
    assert names((log.parent / "in_x.alog").read_text()) == [
        "DEPLOY",
        "NODE_REPORT",
        "NAV_X",
        "NAV_Y",
        "NAV_X",
    ]
    assert main(["log", "clip", "in.alog", "-5", "0.5"]) == 0
    assert names(capsys.readouterr().out) == ["NAV_X", "NAV_Y"]


def test_sort_is_stable_and_can_only_check(log, capsys):
    assert main(["log", "sort", "in.alog", "--check"]) == 1
    assert main(["log", "sort", "in.alog", "out.alog"]) == 0
    assert main(["log", "sort", "out.alog", "-c"]) == 0
    found = list(read_entries((log.parent / "out.alog").read_text().splitlines()))
    assert [e.time for e in found] == sorted(e.time for e in found)
    assert [e.name for e in found][3:6] == ["NAV_X", "NAV_Y", "NAV_X"]


def test_scan_counts_lines_characters_times_and_sources(log, capsys):
    assert main(["log", "scan", "in.alog", "--appstat"]) == 0
    out = capsys.readouterr().out
    rows = {row.split()[0]: row.split()[1:] for row in out.splitlines() if row.strip()}
    assert rows["NAV_X"] == ["3", "21", "0.50", "1.50", "uSimMarine"]
    assert rows["DEPLOY"] == ["1", "4", "1.00", "1.00", "pHelmIvP:1:HELM"]
    assert rows["uSimMarine"] == ["5", "62.50"]
    assert "Total variables: 5" in out
    assert "Start/Stop time: 0.50 / 2.50" in out


def test_scan_orders_lists_and_rates(log, capsys):
    assert main(["log", "scan", "in.alog", "-l", "--sort=lines", "-r"]) == 0
    assert capsys.readouterr().out.split()[:2] == ["NAV_X", "NAV_Y"]
    assert main(["log", "scan", "in.alog", "--rate_only"]) == 0
    total = sum(len(e.value) for e in read_entries(log.read_text().splitlines()))
    assert float(capsys.readouterr().out) == pytest.approx(total / 2.0, abs=0.01)
    summary = summarise(read_entries(log.read_text().splitlines()), aux=False)
    assert [u.name for u in ordered(summary, "start")][-1] == "PFOO_ITER_GAP"
    assert summary.uses["DEPLOY"].sources == {"pHelmIvP": 1}


def test_compressed_logs_and_folders_are_read_alike(log, capsys):
    (log.parent / "L").mkdir()
    (log.parent / "L" / "c.alog.gz").write_bytes(gzip.compress(log_text().encode()))
    assert main(["log", "grep", "L", "DEPLOY", "--v"]) == 0
    assert capsys.readouterr().out == "true\n"


@pytest.mark.parametrize(
    "words",
    [
        ["grep", "NAV_X"],
        ["grep", "nowhere.alog", "NAV_X"],
        ["grep", "in.alog", "a.alog", "b.alog"],
        ["rm", "in.alog"],
        ["clip", "in.alog", "1"],
        ["clip", "in.alog", "a", "b"],
        ["sort", "in.alog", "NAV_X"],
        ["scan", "NAV_X"],
        ["plot", "in.alog", "NOT_THERE"],
        ["plot", "NAV_X"],
        ["plot", "in.alog", "-o", "nowhere/x.png"],
    ],
)
def test_what_cannot_be_done_is_one_line_and_status_one(log, capsys, words):
    assert main(["log", *words]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(Exception, match="found none"):
        find_log(str(tmp_path))


def test_plot_draws_a_picture_of_track_and_panels(log, capsys):
    shapes = [
        ("VIEW_SEGLIST", "pts={0,0:9,9},label=s", 0.1, "h", ""),
        ("VIEW_POLYGON", "pts={0,0:9,0:9,9}", 0.2, "h", ""),
        ("VIEW_POINT", "x=1,y=2,label=p", 0.3, "h", ""),
        ("VIEW_CIRCLE", "x=1,y=1,radius=3", 0.3, "h", ""),
        ("NAV_HEADING", 10.0, 1.0, "s", ""),
        ("NAV_HEADING", 350.0, 1.4, "s", ""),
        ("MODE", "A", 0.0, "h", ""),
    ]
    log.write_text(log_text([*shapes, *POSTS]))
    assert (
        main(["log", "plot", "in.alog", "NAV_HEADING,NAV_X", "MODE", "NAV_Y*", "-o", "p.png", "--dpi=40"])
        == 0
    )
    assert capsys.readouterr().out == "p.png\n"
    assert (log.parent / "p.png").read_bytes().startswith(b"\x89PNG")
    assert main(["log", "plot", "in.alog", "in.alog", "--no-shapes", "--dpi=40"]) == 0
    assert (log.parent / "in.png").stat().st_size > 3000


def test_what_is_drawn_is_what_the_log_says():
    posts = [
        *POSTS,
        ("VIEW_SEGLIST", "pts={0,0:9,9},label=s", 0.1, "h", ""),
        ("VIEW_SEGLIST", "pts={0,0},active=false,label=s", 0.2, "h", ""),
        ("VIEW_POINT", "garbage", 0.2, "h", ""),
        ("NODE_REPORT_LOCAL", "NAME=abe,X=1,Y=1", 0.2, "h", ""),
        ("NAV_X", 99.0, 20.0, "uSimMarine", ""),
    ]
    wanted = Selection.of(["NAV_X", "DEPLOY"])
    picture = collect(read_entries(log_text(posts).splitlines()), "abe", wanted, 0.0, 10.0)
    assert (picture.tracks["abe"].xs, picture.tracks["abe"].ys) == ([1.0, 3.0], [2.0, 4.0])
    assert (picture.tracks["ben"].xs, picture.tracks["ben"].headings) == ([5.0], [90.0])
    assert set(picture.tracks) == {"abe", "ben"}
    assert [key for key, _ in picture.drawings.items()] == [("VIEW_SEGLIST", "s")]
    assert picture.series["NAV_X"].values == [1.0, 3.0, 3.0]
    assert picture.series["DEPLOY"].levels == ["true"]
    assert (picture.start, picture.stop) == (0.1, 2.5)


def test_arrows_stand_on_the_track_at_even_times():
    track = Track([0.0, 5.0, 10.0], [0.0, 5.0, 10.0], [0.0, 0.0, 0.0], [0.0, 9.0], [90.0, 180.0])
    assert arrow_places(track, 2) == [(5.0, 0.0, 90.0), (10.0, 0.0, 180.0)]
    assert arrow_places(Track([0.0], [0.0], [0.0])) == []


def test_courses_break_at_north():
    assert unwrapped_gaps([350.0, 359.0, 1.0, 10.0, 200.0, 10.0]) == [2, 4, 5]


@pytest.mark.parametrize(
    ("name", "vessel"),
    [
        ("LOG_ABE_23_11_2026_____00_35_26.alog", "abe"),
        ("abe.alog", "abe"),
        ("MOOSLog_1_1_2026_____00_00_00.alog.gz", "mooslog"),
    ],
)
def test_the_vessels_name_is_in_the_file_name(tmp_path, name, vessel):
    assert vessel_name(tmp_path / name) == vessel


LINES = st.lists(
    st.one_of(
        st.builds(
            "{:.2f} {} app {}".format,
            st.floats(-5, 5),
            st.sampled_from(["A", "AB", "B_LEN"]),
            st.integers(0, 2),
        ),
        st.sampled_from(["% comment", "junk"]),
    ),
    max_size=20,
)


@given(LINES)
def test_sorting_and_dropping_repeats_lose_nothing_else(lines):
    read = list(read_lines(lines))
    ordered_lines = sorted_lines(read)
    assert sorted(line.text for line in ordered_lines) == sorted(lines)
    assert count_late(line.entry for line in ordered_lines) == 0
    once = [line.text for line in without_repeats(read)]
    assert set(once) == set(lines)
    assert [t for t in once if not t.startswith("%")] == list(
        dict.fromkeys(t for t in lines if not t.startswith("%"))
    )


@given(LINES, st.lists(st.sampled_from(["A", "A*", "app", "B_LEN", "x"]), max_size=3))
def test_a_selection_picks_what_a_slow_reading_of_the_rule_picks(lines, patterns):
    chosen = Selection.of(patterns)
    for entry in read_entries(lines):
        slow = any(
            (p[:-1] == entry.name[: len(p) - 1] or p[:-1] == entry.app[: len(p) - 1]) if p.endswith("*")
            else p in (entry.name, entry.app)
            for p in patterns
        )  # fmt: skip
        assert chosen.picks(entry) is slow
