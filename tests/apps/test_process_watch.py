"""uProcessWatch: present, missing, excused, resurrected."""

import pytest
from app_harness import Harness

from pymoos_lite.apps.process_watch import Pattern, ProcessWatch, parse_apps, parse_mapping, parse_retractions


def watch(block: str = "", apps: tuple[str, ...] = ("pA", "pB", "uProcessWatch"), **options) -> Harness:
    return Harness(ProcessWatch, block, name="uProcessWatch", apps=apps, **options)


def join(harness: Harness, *names: str) -> Harness:
    for name in names:
        harness.home.database.connect(name, harness.host.clock.now())
    return harness


def leave(harness: Harness, *names: str) -> Harness:
    for name in names:
        harness.home.database.disconnect(name, harness.host.clock.now())
    return harness


def test_all_present_is_said_as_soon_as_everybody_has_come():
    harness = join(watch("nowatch = watcher"), "pA").run(3)
    assert harness.values("PROC_WATCH_SUMMARY") == []
    join(harness, "pB").run(3)
    assert harness.values("PROC_WATCH_SUMMARY") == ["All Present"]
    assert harness.values("PROC_WATCH_ALL_OK") == ["true"]
    assert harness.values("PROC_WATCH_FULL_SUMMARY") == ["pA(1/0),pB(1/0)"]
    assert harness.values("PROC_WATCH_EVENT") == ["Noted to be present: [pA]", "Noted to be present: [pB]"]
    assert harness.values("PROC_WATCH_TIME_WARP") == [1.0]


def test_an_app_that_never_came_is_missing_after_ten_seconds():
    harness = join(watch("nowatch = watcher"), "pA").run(9)
    assert "PROC_WATCH_SUMMARY" not in {n for _, n, _ in harness.said}
    harness.run(6)
    assert harness.values("PROC_WATCH_SUMMARY") == ["AWOL: pB"]
    assert harness.values("PROC_WATCH_ALL_OK") == ["false"]
    assert list(harness.app.log.run_warnings) == ["Process [pB] is missing."]


def test_an_app_that_goes_is_missing_and_its_return_takes_the_warning_back():
    harness = join(watch("nowatch = watcher"), "pA", "pB").run(12)
    leave(harness, "pB").run(5)
    assert harness.values("PROC_WATCH_SUMMARY") == ["All Present", "AWOL: pB"]
    assert list(harness.app.log.run_warnings) == ["Process [pB] is missing."]
    join(harness, "pB").run(5)
    assert harness.values("PROC_WATCH_SUMMARY")[-1] == "All Present"
    assert harness.values("PROC_WATCH_FULL_SUMMARY")[-1] == "pA(1/0),pB(2/1)"
    assert harness.values("PROC_WATCH_EVENT")[-2:] == ["Process [pB] is missing.", "Resurrected: [pB]"]
    assert harness.app.log.run_warnings == {}


@pytest.mark.parametrize(("option", "left"), [("false", 1), ("20", 1), ("2", 0)])
def test_warnings_are_taken_back_only_as_configured(option, left):
    harness = join(watch(f"nowatch = watcher\nallow_retractions = {option}"), "pA", "pB").run(12)
    leave(harness, "pB").run(5)
    join(harness, "pB").run(5)
    assert len(harness.app.log.run_warnings) == left


def test_who_announces_its_exit_is_excused():
    harness = join(watch("nowatch = watcher"), "pA", "pB").run(12)
    harness.post("EXITED_NORMALLY", "pB", source="pB")
    leave(harness.run(1), "pB").run(5)
    assert harness.values("PROC_WATCH_EVENT")[-1] == "Process [pB] is gone but excused."
    assert harness.values("PROC_WATCH_SUMMARY")[-1] == "All Present"
    assert harness.app.log.run_warnings == {}


@pytest.mark.parametrize(
    ("block", "watched"),
    [
        ("watch_all = true", "pA,pB,watcher,pX"),
        ("watch_all = antler", "pA,pB"),
        ("watch_all = dbclients", "watcher,pX,pA,pB"),
        ("watch_all = false", ""),
        ("watch_all = false\nwatch = pX, pA", "pX,pA"),
        ("watch_all = false\nwatch = p*", "pA,pB,pX"),
        ("nowatch = p*\nwatch = pA", "pA,watcher"),
    ],
)
def test_who_is_watched(block, watched):
    harness = join(watch(block), "pX", "pA", "pB").run(4)
    assert set(harness.app.list.apps) == set(watched.split(",")) - {""}


def test_our_own_tools_come_and_go_without_a_warning_unless_asked_for():
    harness = join(watch("nowatch = watcher", apps=()), "pymoos_scope_1").run(12)
    leave(harness, "pymoos_scope_1").run(5)
    assert harness.app.list.apps == {}
    assert set(join(watch("watch = pymoos*"), "pymoos_poke").run(3).app.list.apps) >= {"pymoos_poke"}


def test_a_variable_follows_an_app():
    harness = join(watch("watch = pA:A_THERE"), "pA", "pB").run(12)
    leave(harness, "pA").run(4)
    join(harness, "pA").run(4)
    assert harness.values("A_THERE") == ["true", "false", "true"]


def test_summaries_repeat_and_outputs_can_be_renamed():
    block = "nowatch=watcher\nsummary_wait = 5\npost_mapping = PROC_WATCH_SUMMARY, MY_SUMMARY"
    harness = join(watch(block), "pA", "pB").run(21)
    assert harness.values("MY_SUMMARY") == ["All Present"] * len(harness.values("PROC_WATCH_ALL_OK"))
    assert 4 <= len(harness.values("MY_SUMMARY")) <= 5
    assert harness.values("PROC_WATCH_SUMMARY") == []


def test_the_report_shows_state_and_processor_load():
    harness = join(watch("nowatch=watcher"), "pA").run(12)
    harness.post("PA_STATUS", 'AppErrorFlag=false,Uptime=2,cpuload=1.364,MOOSName=pA,Publishing="A,"').run(3)
    rows = {line.split()[0]: line.split()[1:] for line in harness.app.report() if line}
    assert rows["pA"] == ["OK", "1.364", "1/0"]
    assert rows["pB"][0] == "MISSING"


def test_configuration_texts():
    assert parse_apps("pA, u*, pB:VAR") == [Pattern("pA"), Pattern("u", True), Pattern("pB", False, "VAR")]
    assert [parse_retractions(t) for t in ("true", "off", "3")] == [0.0, -1.0, 3.0]
    assert parse_mapping("proc_watch_summary, X") == ("PROC_WATCH_SUMMARY", "X")


@pytest.mark.parametrize(
    ("parse", "text"), [(parse_apps, "*"), (parse_apps, "a*b"), (parse_apps, "pA:"), (parse_apps, "pA,,pB"),
                        (parse_retractions, "soon"), (parse_mapping, "FOO, BAR"), (parse_mapping, "PROC_WATCH_EVENT")]
)  # fmt: skip
def test_bad_configuration_texts_are_refused(parse, text):
    with pytest.raises(ValueError, match="expected"):
        parse(text)
