"""The alpha mission to its end: in lockstep, in real time in one process, and in processes."""

import re
import subprocess
import sys

import pytest

PYMOOS = [sys.executable, "-m", "pymoos_lite.tools.cli"]
SURVEY_AND_HOME = [0, 1, 2, 3, 4]
POINTS = [(60, -40), (60, -160), (150, -160), (180, -100), (150, -40)]


def pymoos(*words, cwd, timeout=240):
    return subprocess.run(
        [*PYMOOS, *map(str, words)], capture_output=True, text=True, timeout=timeout, check=False, cwd=cwd
    )


def logs(folder, suffix="alog"):
    """Text of the one log below `folder`, without its header's lines up to the date."""
    (path,) = folder.rglob(f"*.{suffix}")
    lines = path.read_text().splitlines()
    (date,) = [i for i, line in enumerate(lines[:6]) if line.startswith("%% FILE OPENED ON")]
    return lines[date + 1 :]


def series(lines, name):
    """Time and value of each entry of a variable."""
    found = []
    for line in lines:
        parts = line.split(None, 3)
        if len(parts) == 4 and parts[1] == name:
            found.append((float(parts[0]), parts[3].strip()))
    return found


def waypoints(lines):
    """Indices that the survey went through, in order, without repetitions."""
    indices = []
    for _, value in series(lines, "WPT_INDEX"):
        index = int(float(value))
        if not indices or indices[-1] != index:
            indices.append(index)
    return indices


def modes(lines):
    return [value for _, value in series(lines, "MODE")]


def closest(lines):
    """How near the track came to each survey point, in metres."""
    xs, ys = dict(series(lines, "NAV_X")), dict(series(lines, "NAV_Y"))
    track = [(float(xs[t]), float(ys[t])) for t in xs if t in ys]
    return [min(((x - px) ** 2 + (y - py) ** 2) ** 0.5 for x, y in track) for px, py in POINTS]


@pytest.fixture(scope="module")
def lockstep(tmp_path_factory):
    """Logs of two lockstep runs with the same seed."""
    found = []
    for number in (1, 2):
        folder = tmp_path_factory.mktemp(f"run{number}")
        result = pymoos("sim", "alpha", "--duration", 600, "--seed", 1, "--log-dir", "logs", cwd=folder)
        assert result.returncode == 0, result.stderr
        assert "ended because" in result.stdout
        found.append(folder)
    return found


@pytest.fixture(scope="module")
def sailed(lockstep):
    return logs(lockstep[0])


@pytest.mark.slow
def test_equal_runs_have_equal_logs_byte_for_byte(lockstep):
    first, second = lockstep
    names = [
        sorted(str(p.relative_to(f)) for f in [run] for p in f.rglob("*") if p.is_file()) for run in lockstep
    ]
    assert names[0] == names[1]
    for suffix in ("alog", "ylog"):
        assert logs(first, suffix) == logs(second, suffix)
    assert len(logs(first)) > 10_000


@pytest.mark.slow
def test_the_vessel_surveys_returns_and_stops(sailed):
    assert waypoints(sailed)[:5] == SURVEY_AND_HOME
    assert modes(sailed) == ["ACTIVE:SURVEYING", "ACTIVE:RETURNING", "INACTIVE"]
    assert max(closest(sailed)) < 15.0
    assert series(sailed, "MISSION")[-1][1] == "complete"
    assert float(series(sailed, "NAV_SPEED")[-1][1]) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("mode", [[], ["--processes"]])
def test_real_time_reaches_the_same_waypoints_in_order(tmp_path, sailed, mode):
    result = pymoos(
        "launch", "alpha", "--warp", 25, "--port", 0, "--plain", "--log-dir", "logs", *mode, cwd=tmp_path
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "the mission is over" in result.stdout
    lines = logs(tmp_path)
    assert waypoints(lines) == waypoints(sailed)
    # A helm that only connects after it has chosen its first mode is heard from then on.
    assert modes(lines)[-3:] == modes(sailed)[-3:]
    for real, simulated in zip(closest(lines), closest(sailed), strict=True):
        assert real == pytest.approx(simulated, abs=5.0)


@pytest.mark.slow
def test_a_poke_calls_the_vessel_back(tmp_path):
    result = pymoos("sim", "alpha", "--poke", "60:RETURN=true", "--log-dir", "logs", cwd=tmp_path)
    assert result.returncode == 0
    lines = logs(tmp_path)
    assert waypoints(lines)[:2] == [0, 1]
    assert 3 not in waypoints(lines)
    elapsed = float(re.search(r"alpha: (\d+) mission seconds", result.stdout)[1])
    assert elapsed < 150.0


def test_check_finds_nothing_wrong_with_alpha(tmp_path):
    result = pymoos("check", "alpha", "--strict", cwd=tmp_path)
    assert result.returncode == 0, result.stdout
    assert "0 errors, 0 warnings" in result.stdout
