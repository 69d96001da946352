"""Fleets on the command line: sim, check, launch and commands to a running fleet."""

import io
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rich.console import Console

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.ports import LOOPBACK, RemoteClient, free_port
from pymoos_lite.tools.fleet_view import FleetView, PlainFleet, render

DATA = Path(__file__).parent.parent / "data" / "fleet"
PYMOOS = [sys.executable, "-m", "pymoos_lite.tools.cli"]


def pymoos(*words, **options):
    return subprocess.run(
        [*PYMOOS, *map(str, words)], capture_output=True, text=True, timeout=120, check=False, **options
    )


def test_sim_runs_a_fleet_and_tells_of_its_network(tmp_path):
    result = pymoos("sim", DATA, "--vehicles", 2, "--duration", 30, cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    assert re.search(r"^network: \d\d+ datagrams, 0 lost, 0 squeezed out, 0 for nobody$", result.stdout, re.M)
    assert re.search(
        r"^drifters: 2 vehicles, 30 mission seconds in .* times real time\)$", result.stdout, re.M
    )
    written = [path.name for path in (tmp_path / "logs").iterdir()]
    assert sorted(n for n in written if n.endswith(".moos")) == [
        "targ_abe.moos",
        "targ_ben.moos",
        "targ_shoreside.moos",
    ]
    assert {"LOG_ABE", "LOG_BEN", "XLOG_SHORESIDE"} <= set(written)


def test_sim_pokes_the_shoreside_or_whom_it_is_told(tmp_path):
    pokes = ["--poke", "5:HELLO=shore", "--poke", "6:ben/HELLO=3"]
    assert pymoos("sim", DATA, "--vehicles", 2, "--duration", 9, *pokes, cwd=tmp_path).returncode == 0
    found = {p.parent.name: re.findall(r"HELLO +\S+ +(\S+)", p.read_text()) for p in tmp_path.rglob("*.alog")}
    assert found == {"XLOG_SHORESIDE": ["shore"], "LOG_BEN": ["3.00000"], "LOG_ABE": []}
    result = pymoos("sim", DATA, "--poke", "5:zed/HELLO=1", cwd=tmp_path)
    assert result.returncode == 1
    assert "no community 'zed'; there are shoreside, abe, ben, cal" in result.stderr


def test_sim_ends_early_on_a_condition_at_the_shoreside(tmp_path):
    result = pymoos("sim", DATA, "--duration", 500, "--until", "UFSB_NODE_COUNT = 3", cwd=tmp_path)
    assert result.returncode == 0
    assert re.search(r"3 vehicles, [1-9] mission seconds", result.stdout)


def test_check_tells_all_problems_of_a_fleet(tmp_path):
    folder = shutil.copytree(DATA, tmp_path / "mission")
    assert pymoos("check", folder).returncode == 0
    (folder / "fleet.yaml").write_text((folder / "fleet.yaml").read_text() + "warp: 2\nsed: 3\nwarp: on\n")
    result = pymoos("check", "mission/fleet.yaml", cwd=tmp_path)
    assert result.returncode == 1
    assert "fleet.yaml:14: error: 'warp' was already given at line 12" in result.stdout
    assert "did you mean 'seed'" in result.stdout
    result = pymoos("sim", "mission/fleet.yaml", cwd=tmp_path)
    assert result.returncode == 1
    assert "Traceback" not in result.stderr


LAST_WORDS = """
from pymoos_lite.app import App


class LastWords(App):
    MOOS_NAME = "pLastWords"

    def iterate(self):
        self.notify("MISSION_REPORT", "so far so good")

    def on_quit(self):
        self.notify("MISSION_REPORT", "the figures of the end")
        self.notify("MISSION_RESULT", "pass")
"""


@pytest.mark.slow
def test_a_launched_fleet_obeys_commands_to_some_and_to_all_and_ends_in_an_orderly_way(tmp_path):
    base = free_port()
    text = (DATA / "fleet.yaml").read_text() + f"ports: {{database: {base}}}\n"
    folder = shutil.copytree(DATA, tmp_path / "mission")
    (folder / "fleet.yaml").write_text(text)
    (folder / "last_words.py").write_text(LAST_WORDS)
    shore = folder / "meta_shoreside.moos"
    shore.write_text(shore.read_text().replace("Run = pLogger", "Run = pLogger\n  Run = pLastWords"))
    words = ["launch", folder, "--vehicles", "2", "--warp", "10", "--plain", "--log-dir", tmp_path / "logs"]
    process = subprocess.Popen(
        [*PYMOOS, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=tmp_path
    )
    clock = RealClock(10.0)
    abe, ben = (RemoteClient("watcher", LOOPBACK, base + i, clock=clock) for i in (1, 2))
    try:
        heard = {"abe": {}, "ben": {}}
        stamps = {}
        for client in (abe, ben):
            for name in ("STATION_KEEP", "RETURN", "NODE_REPORT"):
                client.register(name)

        def wait_for(happened):
            end = time.monotonic() + 60.0
            while not happened():
                assert time.monotonic() < end, heard
                for name, client in (("abe", abe), ("ben", ben)):
                    for m in client.poll(0.05):
                        heard[name][m.name] = m.value
                        stamps[m.name] = m.time

        # Once its own report has come back from the other, a vehicle is bridged both ways.
        wait_for(lambda: "NODE_REPORT" in heard["abe"] and "NODE_REPORT" in heard["ben"])
        where = ("--port", base)
        assert pymoos("fleet", "station", "abe", *where).returncode == 0
        wait_for(lambda: heard["abe"].get("STATION_KEEP") == "true")
        assert "STATION_KEEP" not in heard["ben"]
        # Stamped in the fleet's own time, whose warp the command was not told: a helm would ignore it else.
        assert abs(stamps["STATION_KEEP"] - clock.now()) < 60.0 * 10.0
        assert pymoos("fleet", "return", *where).returncode == 0
        wait_for(lambda: heard["abe"].get("RETURN") == heard["ben"].get("RETURN") == "true")
        result = pymoos("fleet", "retrun", *where)
        assert result.returncode == 1
        assert "did you mean 'return'" in result.stderr
        result = pymoos("fleet", "station", "zoe", *where)
        assert (result.returncode, result.stdout) == (1, "")
        assert result.stderr == "pymoos fleet: no vehicle 'zoe' is connected; there are abe, ben\n"
    finally:
        for client in (abe, ben):
            client.close(0.1)
        process.terminate()
        out, _ = process.communicate(timeout=60)
    assert process.returncode == 0, out
    assert "abe reports" in out
    assert "drifters: ended after" in out
    # What is posted while the apps quit is still shown.
    assert "so far so good" not in out
    assert "\nthe figures of the end\n" in out
    assert "mission result: pass" in out
    assert "did not end by itself" not in out
    assert all(p.read_text().strip() for p in (tmp_path / "logs").rglob("*.alog"))


@pytest.mark.slow
def test_the_classic_way_one_launch_per_community_from_templates_by_nsplug_works_as_well(tmp_path):
    base = free_port()
    shared = [
        "WARP=10",
        "LAT_ORIGIN=43.8253",
        "LONG_ORIGIN=-70.3304",
        "COMMS_RANGE=500",
        f"SHORE_PSHARE={base + 200}",
    ]
    running = []
    clock = RealClock(10.0)
    try:
        for i, (name, template) in enumerate(
            (("shoreside", "meta_shoreside"), ("abe", "meta_vehicle"), ("ben", "meta_vehicle"))
        ):
            own = [
                f"VNAME={name}",
                f"MOOS_PORT={base + i}",
                f"PSHARE_PORT={base + 200 + i}",
                "COLOR=red",
                f"START_POS=x={20 * i},y=0",
            ]
            result = pymoos(
                "nsplug", DATA / f"{template}.moos", f"targ_{name}.moos", "-f", *shared, *own, cwd=tmp_path
            )
            assert result.returncode == 0, result.stderr
            running.append(
                subprocess.Popen([*PYMOOS, "launch", f"targ_{name}.moos", "--quiet"], cwd=tmp_path)
            )
        clients = [RemoteClient("watcher", LOOPBACK, base + i, clock=clock) for i in (1, 2)]
        for client in clients:
            client.register("NODE_REPORT")
        heard: list[set[str]] = [set(), set()]
        end = time.monotonic() + 60.0
        while heard != [{"ben"}, {"abe"}]:
            assert time.monotonic() < end, heard
            for names, client in zip(heard, clients, strict=True):
                names.update(m.value.partition(",")[0].removeprefix("NAME=") for m in client.poll(0.05))
        for client in clients:
            client.close(0.1)
    finally:
        for process in running:
            process.terminate()
        statuses = [process.wait(60) for process in running]
    assert statuses == [0, 0, 0]


def test_the_display_tells_who_is_silent_and_what_is_warned_of(capsys):
    from pymoos_lite.core.message import Message
    from pymoos_lite.records.appcast import AppCast
    from pymoos_lite.records.node_report import NodeReport

    view = FleetView(["abe", "ben"], 100.0)
    report = NodeReport(name="abe", x=1.0, y=2.0, speed=1.0, heading=90.0, mode="MODE@ACTIVE:LOITERING")
    cast = AppCast("pHelmIvP", node="abe", run_warnings=(("low battery", 1),))
    mail = [
        Message("NODE_REPORT", report.to_text(), 101.0, "pShare"),
        Message("APPCAST", cast.to_text(), 101.0, "pHelmIvP"),
        Message("COLLISION_TOTAL", 1.0, 101.0, "uFldCollisionDetect"),
        Message("NEAR_MISS_TOTAL", 2.0, 101.0, "uFldCollisionDetect"),
        Message("NODE_REPORT", "junk", 101.0, "x"),
        Message("APPCAST", "junk", 101.0, "x"),
    ]
    view.take(mail, 101.0)
    assert (view.state_of("abe"), view.state_of("ben")) == ("LOITERING", "not heard yet")
    PlainFleet(sys.stdout).refresh(view, 4.0)
    out = capsys.readouterr().out
    for part in ("abe reports", "abe pHelmIvP: low battery", "collision number 1", "abe 1,2"):
        assert part in out
    view.take([], 110.0)
    assert view.state_of("abe") == "silent for 9 s"
    panel = render(view, 4.0)
    assert "fleet of 2" in str(panel.title)
    console = Console(width=100, file=io.StringIO())
    console.print(panel)
    shown = console.file.getvalue()
    for part in ("abe ", "silent for 9 s", "not heard yet", "near misses 2   collisions 1", "low battery"):
        assert part in shown
