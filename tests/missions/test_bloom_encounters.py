"""Close encounters of the bloom mission, read from logs: which, when, and what both vessels were doing, and why."""

import pytest

from missions.bloom.encounters import closest_time, read_encounters, widest_turn
from pymoos_lite.tools import cli

HEADER = "%% LOG FILE:       x\n%% FILE OPENED ON  Thu Jan  1 00:00:00 2026\n%% LOGSTART           0.00\n"


def line(time, name, value):
    return f"{time:<15.5f} {name:<20} app            {value}\n"


def sail(x_at, mode, samples_from=1e9, heading_at=lambda second: 90.0):
    """A vessel along y = 0 for two minutes, a position and a heading each second."""
    text = HEADER + line(0.0, "MODE", f"ACTIVE:{mode}") + line(0.0, "WAIT_TO_SAMPLE", "false")
    for second in range(120):
        if second >= samples_from:
            text += line(second, "WAIT_TO_SAMPLE", "true")
        text += line(second, "NAV_X", x_at(second)) + line(second, "NAV_Y", 0.0)
        text += line(second, "NAV_HEADING", heading_at(second))
    return text


def report(time, one, other, rank, cpa):
    return line(time, "UCD_REPORT", f"cpa={cpa},vname1={one},vname2={other},rank={rank}, alpha=1, beta=2")


SHORE = (
    HEADER
    + report(70.0, "abe", "ben", "collision", 2.0)
    + line(70.0, "COLLISION_TOTAL", 1.0)
    + report(90.0, "abe", "cal", "clear", 15.0)
    + report(110.0, "cal", "ben", "near_miss", 5.0)
    + line(110.0, "NEAR_MISS_TOTAL", 1.0)
)


@pytest.fixture
def logs(tmp_path):
    def write(shore=SHORE):
        texts = {
            "LOG_ABE_1": sail(lambda s: 0.0, "EXPLOITING", samples_from=30),
            "LOG_BEN_1": sail(lambda s: abs(50 - s) + 2.0, "EXPLORING"),
            "LOG_CAL_1": sail(lambda s: 5.0 + abs(100 - s), "EXPLOITING"),
            "XLOG_SHORESIDE_1": shore,
        }
        for name, text in texts.items():
            (tmp_path / name).mkdir()
            (tmp_path / name / f"{name}.alog").write_text(text)
        return tmp_path

    return write


def test_every_collision_and_near_miss_is_told_with_what_both_were_doing(logs, capsys):
    found = read_encounters(logs())
    assert [(met.rank, met.cpa, met.names) for met in found] == [
        ("collision", 2.0, ("abe", "ben")),
        ("near_miss", 5.0, ("cal", "ben")),
    ]
    assert found[0].time == 50.0, "when they were closest, not when it was reported"
    assert found[0].doing == ("sampling", "exploring")
    assert found[1].doing == ("exploiting", "exploring")
    assert [met.cause for met in found] == ["sampling", "avoidance"]


@pytest.mark.parametrize(
    ("apart", "sampled", "cause"),
    [
        (lambda s: 30.0 - 0.5 * s, (), "avoidance"),
        (lambda s: 30.0 - 0.5 * s, (10, 30), "avoidance"),  # over before they came near
        (lambda s: 30.0 - 0.5 * s, (45, 50), "sampling"),  # over when they were closest
        (lambda s: 30.0 - 0.5 * s, (10, 50), "sampling"),  # begun before they came near
        (lambda s: 9.0 - 0.1 * s, (), "start"),
        (lambda s: 9.0 - 0.1 * s, (5, 8), "sampling"),
    ],
)
def test_a_cause_is_looked_for_in_all_the_time_for_which_they_were_near(tmp_path, apart, sampled, cause):
    switches = "".join(
        line(time, "WAIT_TO_SAMPLE", value) for time, value in zip(sampled, ("true", "false"), strict=False)
    )
    texts = {
        "LOG_ABE_1": sail(lambda s: 0.0, "EXPLORING") + switches,
        "LOG_BEN_1": sail(lambda s: max(apart(s), 2.0), "EXPLORING"),
        "XLOG_SHORESIDE_1": HEADER + report(60.0, "abe", "ben", "collision", 2.0),
    }
    for name, text in texts.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.alog").write_text(text)
    (met,) = read_encounters(tmp_path)
    assert met.cause == cause


@pytest.mark.parametrize(
    ("heading_at", "cause"),
    [
        (lambda s: (20.0 * s) % 360.0 if s < 30 else 0.0, "avoidance"),  # before they came near
        (lambda s: 300.0 + s if s < 60 else s - 60.0, "avoidance"),  # twenty degrees, through north
        (lambda s: (300.0 + 10.0 * max(0, s - 42)) % 360.0, "turning"),
        (lambda s: (300.0 - 10.0 * max(0, s - 42)) % 360.0, "turning"),
    ],
)
def test_who_turns_round_beside_another_is_told_apart(tmp_path, heading_at, cause):
    """They come within 10 m at second 40 and within 2 m at 56."""
    texts = {
        "LOG_ABE_1": sail(lambda s: 0.0, "EXPLORING", heading_at=heading_at),
        "LOG_BEN_1": sail(lambda s: max(30.0 - 0.5 * s, 2.0), "EXPLORING"),
        "XLOG_SHORESIDE_1": HEADER + report(56.0, "ben", "abe", "collision", 2.0),
    }
    for name, text in texts.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.alog").write_text(text)
    (met,) = read_encounters(tmp_path)
    assert met.cause == cause


def test_a_turn_is_measured_from_its_leftmost_to_its_rightmost():
    there_and_back = [(0.0, 350.0), (1.0, 20.0), (2.0, 60.0), (3.0, 340.0), (4.0, 100.0)]
    assert widest_turn(there_and_back, 0.0, 3.0) == 80.0
    assert widest_turn(there_and_back, 1.5, 3.0) == 80.0, "what it had when they came near counts"
    assert widest_turn(there_and_back, 0.0, 2.0) == 70.0
    assert widest_turn(there_and_back, 2.5, 2.6) == 0.0
    assert widest_turn([], 0.0, 9.0) == 0.0


def test_the_command_prints_them_and_counts_them_by_cause(logs, capsys):
    assert cli.main(["bloom", "encounters", str(logs())]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "     50 s  collision   2.00 m  abe (sampling) and ben (exploring): sampling"
    assert lines[2:] == [
        "1 collisions",
        "  1 sampling: one of them sampled, its avoidance off, after they had come within 10 m",
        "1 near misses",
        "  1 avoidance: with avoidance at work on both, and neither turned round",
    ]


def test_several_runs_are_told_of_together(logs, tmp_path, capsys):
    folder = logs()
    twin = tmp_path / "twin"
    twin.mkdir()
    for name in ("LOG_ABE_1", "LOG_BEN_1", "LOG_CAL_1", "XLOG_SHORESIDE_1"):
        (folder / name).rename(twin / name)
    assert cli.main(["bloom", "encounters", str(twin), str(twin)]) == 0
    assert "2 collisions" not in capsys.readouterr().out, "the same folder twice is one run"
    logs()
    assert cli.main(["bloom", "encounters", str(folder), str(twin)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[0] for line in lines[:4]] == [str(folder)] * 2 + [str(twin)] * 2
    assert lines[4] == "2 collisions"


def test_logs_that_do_not_tell_of_all_that_was_counted_are_refused(logs, capsys):
    folder = logs(HEADER + line(70.0, "COLLISION_TOTAL", 2.0) + report(70.0, "abe", "ben", "collision", 2.0))
    assert cli.main(["bloom", "encounters", str(folder)]) == 1
    assert "2 were counted, but the logs tell of 1" in capsys.readouterr().err


def test_a_folder_without_logs_is_refused(tmp_path, capsys):
    assert cli.main(["bloom", "encounters", str(tmp_path)]) == 1
    assert "it takes the logs of the vessels" in capsys.readouterr().err


def test_the_closest_moment_is_looked_for_only_between_the_two_times():
    still = [(float(s), 0.0, 0.0) for s in range(100)]
    passing = [(float(s), abs(50.0 - s), 0.0) for s in range(100)]
    assert closest_time(still, passing, 0.0, 99.0) == 50.0
    assert closest_time(still, passing, 0.0, 30.0) == 30.0
    assert closest_time(still, passing, 60.0, 99.0) == 60.0
    assert closest_time([], passing, 0.0, 99.0) == 99.0
