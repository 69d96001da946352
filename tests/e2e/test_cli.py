"""The command line as a person uses it: real processes, loopback, free ports."""

import re
import subprocess
import sys

import pytest

PYMOOS = [sys.executable, "-m", "pymoos_lite.tools.cli"]


def pymoos(*words, **options):
    return subprocess.run(
        [*PYMOOS, *map(str, words)], capture_output=True, text=True, timeout=60, check=False, **options
    )


def test_help_names_every_command_and_imports_next_to_nothing():
    code = (
        "import sys; from pymoos_lite.tools.cli import main; main(['--help']);"
        "heavy = {'numpy', 'numba', 'scipy', 'matplotlib', 'rich', 'msgpack', 'yaml'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    for command in ("launch", "sim", "check", "scope", "poke", "log", "list", "help"):
        assert re.search(rf"^  {command} ", result.stdout, re.MULTILINE)


def test_an_unknown_command_gets_the_nearest_one():
    result = pymoos("lunch")
    assert result.returncode == 2
    assert "did you mean 'launch'?" in result.stderr


def test_an_unknown_mission_is_one_clear_line():
    result = pymoos("sim", "alhpa")
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    assert "no such mission file" in result.stderr


def test_check_lists_all_problems_at_once_with_file_and_line(mission, tmp_path):
    path = mission("pCounter", "pCoutner ~ other")
    path.write_text(path.read_text().replace("  CommsTick = 10", "  AppTik = 10\n  CommsTick = ten", 1))
    result = pymoos("check", path.name, cwd=tmp_path)
    assert result.returncode == 1
    assert re.search(r"^small\.moos:\d+: warning: .*'AppTik'; did you mean 'AppTick'\?", result.stdout, re.M)
    assert re.search(r"^small\.moos:\d+: error: .*CommsTick = 'ten' is not a number", result.stdout, re.M)
    assert re.search(
        r"^small\.moos:\d+: warning: .*'pCoutner'; did you mean 'pCounter'\?", result.stdout, re.M
    )
    assert re.search(r"1 errors, \d+ warnings; would run pCounter$", result.stdout, re.M)
    assert pymoos("sim", path, "--duration", "1").returncode == 1


def test_strict_turns_warnings_into_refusal(mission, tmp_path):
    path = mission("pCounter", "pNotYetThere")
    assert pymoos("sim", path, "--duration", "1", cwd=tmp_path).returncode == 0
    result = pymoos("sim", path, "--duration", "1", "--strict", cwd=tmp_path)
    assert result.returncode == 1
    assert "there is no app 'pNotYetThere'" in result.stderr


def test_sim_pokes_and_ends_when_told(mission, tmp_path):
    path = mission("pCounter")
    result = pymoos(
        "sim", path, "--duration", "50", "--until", "ECHO = stop", "--poke", "7:ORDER=stop", cwd=tmp_path
    )
    assert result.returncode == 0
    assert re.match(r"alpha: [78] mission seconds", result.stdout)
    bad = pymoos("sim", path, "--poke", "seven:ORDER=stop", cwd=tmp_path)
    assert bad.returncode == 1
    assert "expected T:VAR=VALUE" in bad.stderr


@pytest.mark.slow
@pytest.mark.parametrize("mode", [[], ["--processes"]])
def test_launch_poke_scope_and_a_polite_end(mission, tmp_path, mode):
    path = mission("pCounter")
    launch = subprocess.Popen(
        [*PYMOOS, "launch", str(path), "--port", "0", "--warp", "5", "--plain", *mode],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=tmp_path,
    )
    try:
        port = re.search(r"port (\d+), warp 5", launch.stdout.readline())[1]
        poke = pymoos("poke", "--port", port, "ORDER=hello", "SPEED=2.5", "TEXT:=3")
        assert poke.returncode == 0
        assert 'ORDER = "hello"' in poke.stdout
        assert "SPEED = 2.5" in poke.stdout
        assert 'TEXT = "3"' in poke.stdout
        scope = pymoos("scope", "--once", "--csv", "--port", port, "ECHO", "SPEED")
        assert scope.returncode == 0
        rows = [line.split(",") for line in scope.stdout.splitlines()]
        assert rows[0] == ["Variable", "Source", "Time", "Community", "Value"]
        echo, speed = rows[1], rows[2]
        assert (echo[0], echo[1], echo[3]) == ("ECHO", "pCounter", "alpha")
        assert 0.0 <= float(speed[2]) < 300.0
        refused = pymoos("poke", "--port", port, "SPEED=fast")
        assert refused.returncode == 1
        assert "SPEED, which holds a double" in refused.stderr
        assert pymoos("scope", "--once", "--port", port, "NEVER_POSTED").returncode == 1
    finally:
        launch.terminate()
        said = launch.stdout.read()
        launch.stdout.close()
        launch.wait(20)
    assert launch.returncode == 0
    assert "ended after" in said


def test_tools_say_when_nobody_answers():
    from pymoos_lite.hosts.ports import free_port

    result = pymoos("poke", "--port", free_port(), "--timeout", "0.3", "X=1")
    assert result.returncode == 1
    assert "no community answers" in result.stderr


def test_two_communities_cannot_share_a_port(mission, tmp_path):
    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        for mode in ([], ["--processes"]):
            result = pymoos("launch", mission("pCounter"), "--port", port, "--plain", *mode, cwd=tmp_path)
            assert result.returncode == 1
            assert f"cannot use UDP port {port}" in result.stderr


@pytest.mark.parametrize("name", ["uTimerScript", "pLogger", "uSimMarineV22"])
def test_help_of_an_app_comes_from_its_declarations(name):
    result = pymoos("help", name)
    assert result.returncode == 0, result.stderr
    assert "Parameters:" in result.stdout
    assert "AppTick" in result.stdout
    assert f"ProcessConfig = {name}" in pymoos("help", name, "--example").stdout
