"""A single-vehicle mission as MOOS-IvP users write them, with the usual apps, launched unmodified.

The text is ours; its shape (globals, blocks, idioms, a viewer, an app and a parameter that we lack) is that of
the missions people have.
"""

import re
import subprocess
import sys
import textwrap

import pytest

PYMOOS = [sys.executable, "-m", "pymoos_lite.tools.cli"]

MOOS = """\
    // Level 1: globals
    ServerHost   = localhost
    ServerPort   = 9000
    Simulator    = true
    Community    = henry
    MOOSTimeWarp = 1
    // some pond
    LatOrigin  = 43.825300
    LongOrigin = -70.330400

    //------------------------------------------
    // Antler configuration  block
    ProcessConfig = ANTLER
    {
      MSBetweenLaunches = 100

      Run = MOOSDB          @ NewConsole = false
      Run = pLogger         @ NewConsole = false
      Run = uSimMarineV22   @ NewConsole = false
      Run = pMarinePIDV22   @ NewConsole = false
      Run = pHelmIvP        @ NewConsole = false
      Run = pMarineViewer   @ NewConsole = false
      Run = uProcessWatch   @ NewConsole = false
      Run = pNodeReporter   @ NewConsole = false
      Run = pRealm          @ NewConsole = false
      Run = uTimerScript    @ NewConsole = false ~ uTimerScript_GO
      Run = uNotInventedYet @ NewConsole = false
    }

    ProcessConfig = pLogger
    {
      AppTick   = 8
      CommsTick = 8
      AsyncLog = true
      File = LOG_HENRY
      Path = ./
      SyncLog = true @ 0.2
      FileTimeStamp = true
      LogAuxSrc = true
      WildCardLogging     = true
      WildCardOmitPattern = *_STATUS
      WildCardOmitPattern = DB_VARSUMMARY
      WildCardExclusionLog = true
      Log = IVPHELM_LIFE_EVENT @ 0 NOSYNC
    }
    ProcessConfig = uProcessWatch
    {
      AppTick    = 4
      CommsTick  = 4
      watch_all  = true
      nowatch    = uXMS*
      nowatch    = uMAC*
    }
    ProcessConfig = uSimMarineV22
    {
      AppTick   = 4
      CommsTick = 4
      start_pos  = x=0, y=0, heading=90, speed=0
      prefix     = NAV
      turn_rate  = 95
      thrust_map = 0:0, 20:1, 40:2, 60:3, 80:4, 100:5
    }
    ProcessConfig = pHelmIvP
    {
      AppTick    = 4
      CommsTick  = 4
      bhv_dir_not_found_ok = true
      Behaviors  = henry.bhv
      Domain     = course:0:359:360
      Domain     = speed:0:4:41
      ok_skew    = any
      active_start = true
    }
    ProcessConfig = pMarinePIDV22
    {
      AppTick   = 20
      CommsTick = 20
      verbose = true
      depth_control = false
      yaw_pid_kp = 1.2
      yaw_pid_kd = 0.0
      yaw_pid_ki = 0.3
      yaw_pid_integral_limit = 0.07
      speed_factor = 20
      maxrudder = 100
      maxthrust = 100
    }
    ProcessConfig = pMarineViewer
    {
      AppTick   = 4
      CommsTick = 4
      tiff_file = forrest19.tif
      button_one = DEPLOY # DEPLOY=true
    }
    ProcessConfig = pNodeReporter
    {
      AppTick   = 2
      CommsTick = 2
      platform_type   = KAYAK
      platform_color  = yellow
      platform_length = 4
      platfrom_beam   = 1
    }
    ProcessConfig = uTimerScript_GO
    {
      event = var=MOOS_MANUAL_OVERRIDE, val="false", time=1
      event = var=DEPLOY, val="true", time=2
      reset_max = nolimit
    }
"""

BHV = """\
    initialize   DEPLOY = false
    initialize   RETURN = false

    //----------------------------------------------
    Behavior = BHV_Waypoint
    {
      name       = waypt_survey
      pwt        = 100
      condition  = RETURN = false
      condition  = DEPLOY = true
      endflag    = RETURN = true
      configflag = CRUISE_SPD = $[SPEED]
      wptflag    = HIT_AT = $[PX],$[PY]
      updates    = WPT_UPDATE
      perpetual  = true
      lead = 8
      lead_damper = 1
      lead_to_start = true
      speed = 2   // meters per second
      capture_line = true
      capture_radius = 5.0
      slip_radius = 15.0
      points = 40,0 : 40,-40 : 0,-40
      repeat = 1
      visual_hints = nextpt_color=yellow, nextpt_lcolor=gray70
    }
    Behavior = BHV_Waypoint
    {
      name       = waypt_return
      pwt        = 100
      condition  = RETURN = true
      condition  = DEPLOY = true
      perpetual  = true
      endflag    = RETURN = false
      endflag    = DEPLOY = false
      speed = 2.0
      radius = 3.0
      nm_radius = 15.0
      points = 0,0
    }
"""


@pytest.fixture
def henry(tmp_path):
    (tmp_path / "henry.moos").write_text(textwrap.dedent(MOOS))
    (tmp_path / "henry.bhv").write_text(textwrap.dedent(BHV))
    return tmp_path


def pymoos(*words, cwd):
    return subprocess.run(
        [*PYMOOS, *map(str, words)], capture_output=True, text=True, timeout=120, check=False, cwd=cwd
    )


def test_what_we_lack_gets_one_warning_each_with_its_line(henry):
    result = pymoos("check", "henry.moos", cwd=henry)
    assert result.returncode == 0, result.stdout
    text = textwrap.dedent(MOOS).splitlines()

    def line_of(fragment):
        return next(i for i, row in enumerate(text, 1) if fragment in row)

    found = {int(m[1]): m[2] for m in re.finditer(r"^henry\.moos:(\d+): warning: (.*)$", result.stdout, re.M)}
    expected = {
        line_of("Run = pMarineViewer"): "pMarineViewer",
        line_of("Run = uNotInventedYet"): "uNotInventedYet",
        line_of("platfrom_beam"): "did you mean 'platform_beam'",
    }
    for line, text_of in expected.items():
        assert text_of in found[line], result.stdout
    others = {line: said for line, said in found.items() if line not in expected}
    # The realm app has no block, which is worth a word; nothing else is.
    assert all("pRealm" in said for said in others.values()), others


def test_it_is_refused_under_strict(henry):
    result = pymoos("sim", "henry.moos", "--strict", "--duration", 5, cwd=henry)
    assert result.returncode == 1
    assert "uNotInventedYet" in result.stderr


@pytest.mark.slow
def test_it_sails_its_survey_and_returns(henry):
    result = pymoos("sim", "henry.moos", "--duration", 300, "--seed", 1, "--log-dir", "logs", cwd=henry)
    assert result.returncode == 0, result.stderr
    (alog,) = (henry / "logs").rglob("LOG_HENRY*.alog")
    text = alog.read_text()
    stats = re.findall(r"^(\S+)\s+HIT_AT\s+\S+\s+(\S+)", text, re.M)
    assert len(stats) == 6  # three points, twice
    reached = [tuple(float(v) for v in value.split(",")) for _, value in stats]
    for (x, y), (px, py) in zip(reached, [(40, 0), (40, -40), (0, -40)] * 2, strict=True):
        assert abs(x - px) < 16
        assert abs(y - py) < 16
    returns = re.findall(r"^\S+\s+RETURN\s+\S+\s+(\S+)", text, re.M)
    assert returns[0] == "false"
    assert "true" in returns
    assert re.search(r"^\S+\s+DEPLOY\s+pHelmIvP:\d+:waypt_return\s+false", text, re.M)
    assert re.search(r"^\S+\s+NODE_REPORT_LOCAL\s+pNodeReporter\s+NAME=henry,\S*TYPE=(?i:kayak)", text, re.M)
    assert re.search(r"^\S+\s+PROC_WATCH_SUMMARY\s+uProcessWatch\s+All Present", text, re.M)
    for suffix in ("slog", "xlog", "ylog", "_moos"):
        assert list((henry / "logs").rglob(f"*.{suffix}")), suffix


def test_a_mission_with_a_faulty_behaviour_file_starts_nothing_and_says_where(henry):
    text = (henry / "henry.bhv").read_text().replace("capture_radius = 5.0", "captur_radius = 5.0")
    (henry / "henry.bhv").write_text(text)
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "captur_radius" in row)
    for command in (
        ["sim", "henry.moos", "--log-dir", "logs"],
        ["launch", "henry.moos", "--port", "0", "--plain"],
    ):
        result = pymoos(*command, cwd=henry)
        assert result.returncode == 1
        assert f"henry.bhv:{line}: " in result.stderr
        assert "did you mean 'capture_radius'?" in result.stderr
    assert not (henry / "logs").exists()
