"""pLogger in lockstep: what lands in which file."""

import gzip
import re

import pytest

from pymoos_lite.app import App, AppContext
from pymoos_lite.apps.log_format import SyncTable, copy_name, log_date, log_stem
from pymoos_lite.apps.logger import LoggedVariable, Logger, parse_log_line, parse_sync
from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.records.alog import AlogHeader, read_entries


class Speaker(App):
    """Posts what it is told to, in order, one step after the other."""

    DEFAULT_TICK = 10.0
    BLOCK_OPTIONAL = True
    script: tuple = ()

    def iterate(self):
        if self.iteration <= len(self.script):
            for name, value in self.script[self.iteration - 1]:
                self.notify(name, value, aux="1:x" if name == "AUX" else "")


def sail(tmp_path, block, script=(), duration=3.0, seed=1, mission_file="", **context):
    """Run a logger with this block beside a speaker; returns the logger's folder."""
    host = Lockstep(seed, tmp_path)
    home = host.add_community("abe")
    body = f"ProcessConfig = pLogger\n{{\n{block}\n}}\n"
    lines = parse_mission(body).blocks[0].lines if block is not None else ()
    told = type("Told", (Speaker,), {"script": script})
    apps = [(Logger, "pLogger", lines), (told, "told", ())]
    for cls, name, own in apps:
        host.add_app(
            home,
            cls,
            AppContext(
                name,
                "abe",
                host.clock,
                LocalConnection(home.database, name, host.clock),
                own,
                log_dir=tmp_path,
                seed=seed,
                deterministic=True,
                has_block=block is not None,
                mission_file=mission_file,
                mission_dir=tmp_path,
                **context,
            ),
        )
    host.run(duration)
    host.stop()
    assert host.failures == []
    (folder,) = [p for p in tmp_path.iterdir() if p.is_dir()]
    return folder


def entries(folder, kind="alog"):
    (path,) = folder.glob(f"*.{kind}")
    return list(read_entries(path.read_text().splitlines()))


def names(folder, kind="alog"):
    return {entry.name for entry in entries(folder, kind)}


def test_wildcard_logging_logs_every_post_once_from_the_first_on(tmp_path):
    script = tuple([("BURST", float(i)), ("BURST", float(i) + 0.5)] for i in range(20))
    found = [e.number for e in entries(sail(tmp_path, "WildCardLogging = true", script)) if e.name == "BURST"]
    assert found == [i / 2 for i in range(40)]


def test_without_a_block_everything_is_logged_and_with_an_empty_one_nothing(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert {"X", "DB_TIME", "TOLD_STATUS"} <= names(sail(tmp_path / "a", None, ([("X", 1.0)],)))
    assert names(sail(tmp_path / "b", "AppTick = 5", ([("X", 1.0)],))) == set()


def test_files_and_folder_are_named_by_stem_date_and_time(tmp_path):
    folder = sail(tmp_path, "File = LOG_ABE\nWildCardExclusionLog=true\nSyncLog = true")
    assert folder.name == "LOG_ABE_1_1_2026_____00_00_00"
    assert sorted(p.name for p in folder.iterdir()) == [f"{folder.name}.{e}" for e in
                                                        ("alog", "blog", "slog", "xlog", "ylog")]  # fmt: skip


def test_without_time_stamp_the_names_are_plain(tmp_path):
    folder = sail(tmp_path, "File = abe\nFileTimeStamp = false")
    assert (folder.name, (folder / "abe.alog").is_file()) == ("abe", True)


def test_equal_runs_give_equal_logs_in_two_folders(tmp_path):
    script = tuple([("X", i * 0.1), ("AUX", f"text {i}")] for i in range(10))
    first = sail(tmp_path, "WildCardLogging = true\nLogAuxSrc=true", script)
    before = (first / f"{first.name}.alog").read_text()
    with pytest.raises(ValueError, match="too many values"):
        sail(tmp_path, "WildCardLogging = true\nLogAuxSrc=true", script)
    second = tmp_path / f"{first.name}_2"
    after = (second / f"{first.name}.alog").read_text()
    assert before.split("\n")[2:] == after.split("\n")[2:]
    assert (first / f"{first.name}.alog").read_text() == before


def test_omit_patterns_and_explicit_lines(tmp_path):
    block = (
        "WildCardLogging = true\nWildCardOmitPattern = *_STATUS, DB_*\nWildCardOmitPattern = VIEW_*\n"
        "Log = VIEW_POLYGON @ 0 NOSYNC\n"
    )
    script = ([("VIEW_POLYGON", "p"), ("VIEW_POINT", "q"), ("X", 1.0)],)
    found = names(sail(tmp_path, block, script))
    assert {"VIEW_POLYGON", "X", "LOGGER_DIRECTORY"} <= found
    assert not found & {"VIEW_POINT", "DB_TIME", "TOLD_STATUS", "PLOGGER_STATUS"}


def test_accept_patterns_restrict_wildcard_logging(tmp_path):
    script = ([("NAV_X", 1.0), ("NAV_LONG", 1.0), ("X", 1.0)],)
    assert names(sail(tmp_path, "WildCardLogging=true\nWildCardPattern = NAV_?, NAV_X", script)) == {"NAV_X"}


def test_what_is_left_out_goes_to_the_xlog_without_header_if_asked(tmp_path):
    block = "WildCardLogging = true\nWildCardOmitPattern = B*\nWildCardExclusionLog = true"
    folder = sail(tmp_path, block, ([("A", 1.0), ("B", 2.0), ("BB", "x")],))
    assert names(folder, "xlog") == {"B", "BB"}
    assert not names(folder) & {"B", "BB"}
    assert not (folder / f"{folder.name}.xlog").read_text().startswith("%")


def test_an_explicit_period_thins_out_and_keeps_the_last_value(tmp_path):
    script = tuple([("X", float(i))] for i in range(20))
    found = [e.number for e in entries(sail(tmp_path, "Log = X @ 0.5", script)) if e.name == "X"]
    assert found[0] == 0.0
    assert found[-1] == 19.0
    assert 4 <= len(found) <= 6


def test_header_options_and_precision(tmp_path):
    block = "WildCardLogging=true\nMarkDataType = true\nDoublePrecision = 2\nLogAuxSrc = true"
    folder = sail(tmp_path, block, ([("X", 1.0), ("AUX", "t")],))
    text = (folder / f"{folder.name}.alog").read_text()
    header = AlogHeader()
    list(read_entries(text.splitlines(), header))
    assert header.marked
    assert header.start == 1767225600.0
    assert "FILE OPENED ON  Thu Jan  1 00:00:00 2026" in text
    assert re.search(r"X +told +D:1\.00 \n", text)
    assert re.search(r"AUX +told:1:x +S:t \n", text)


def test_binary_values_stand_in_the_blog(tmp_path):
    script = ([("RAW", b"\x00\nabc"), ("X", 1.0)], [("RAW", b"")])
    folder = sail(tmp_path, "WildCardLogging=true", script)
    blog = (folder / f"{folder.name}.blog").read_bytes()
    found = []
    for entry in entries(folder):
        if entry.name == "RAW":
            match = re.fullmatch(
                r"<MOOS_BINARY>File=(.*)\.blog,Offset=(\d+),Bytes=(\d+)</MOOS_BINARY>", entry.value
            )
            assert match is not None
            assert match[1] == folder.name
            found.append(blog[int(match[2]) : int(match[2]) + int(match[3])])
    assert found == [b"\x00\nabc", b""]


def test_compressed_logs_hold_the_same(tmp_path):
    folder = sail(tmp_path, "WildCardLogging=true\nCompressAlogs=true", ([("X", 1.0)],))
    text = gzip.decompress((folder / f"{folder.name}.alog.gz").read_bytes()).decode()
    assert "X" in {e.name for e in read_entries(text.splitlines())}


def test_the_slog_is_a_table_of_fresh_doubles(tmp_path):
    script = ([("X", 1.5), ("Y", "text")], *[[]] * 6, [("X", 2.5)])
    folder = sail(tmp_path, "SyncLog = true @ 0.5\nLog = X @ 0\nLog = Y @ 0\nLog = Z @ 0, NOSYNC", script)
    rows = [
        r.split() for r in (folder / f"{folder.name}.slog").read_text().splitlines() if not r.startswith("%")
    ]
    assert [row[1] for row in rows[:3]] == ["1.5", "2.5", "NaN"]
    assert {len(row) for row in rows} == {3}
    text = (folder / f"{folder.name}.slog").read_text()
    assert "%%   (1) TIME\n%%   (2) X\n%%   (3) Y\n" in text


def test_operators_notes_stand_in_the_ylog(tmp_path):
    folder = sail(tmp_path, "WildCardLogging=true", ([("MOOS_DEBUG", "look\nhere")],))
    (row,) = [r for r in (folder / f"{folder.name}.ylog").read_text().splitlines() if not r.startswith("%")]
    assert row.split() == ["0.000", "MOOS_DEBUG", "told", "look", "here"]
    assert "MOOS_DEBUG" in names(folder)


def test_mission_and_requested_files_are_copied(tmp_path):
    (tmp_path / "alpha.moos").write_text("ServerPort = 9000\n")
    (tmp_path / "alpha.bhv").write_text("behavior")
    script = ([("PLOGGER_CMD", "COPY_FILE_REQUEST = alpha.bhv")],)
    folder = sail(tmp_path, "WildCardLogging=true", script, mission_file="alpha.moos")
    assert (folder / "alpha._bhv").read_text() == "behavior"
    copy = (folder / f"{folder.name}._moos").read_text()
    assert copy.endswith("ServerPort = 9000\n")
    assert copy.startswith("%%%")


def test_a_restart_begins_a_new_log(tmp_path):
    script = ([("X", 1.0)], *[[]] * 15, [("LOGGER_RESTART", "now")], *[[]] * 5, [("X", 2.0)])
    with pytest.raises(ValueError, match="too many"):
        sail(tmp_path, "WildCardLogging=true", script, duration=4.0)
    folders = sorted(p for p in tmp_path.iterdir() if p.is_dir())
    assert [[e.number for e in entries(f) if e.name == "X"] for f in folders] == [[1.0], [2.0]]


def test_a_log_request_adds_a_variable_at_run_time(tmp_path):
    script = ([("PLOGGER_CMD", "LOG_REQUEST=X @ 0, NOSYNC")], *[[]] * 10, [("X", 1.0)])
    assert names(sail(tmp_path, "AppTick = 5", script)) == {"X"}


def test_a_monitored_variable_that_stays_away_is_reported(tmp_path):
    folder = sail(tmp_path, "WildCardLogging = true\nLog = X @ 0, MONITOR", duration=15.0)
    assert any(e.name == "MOOS_DEBUG" and "variable X" in e.value for e in entries(folder))


def test_the_directory_is_published_and_status_tells_the_source_style(tmp_path):
    folder = sail(tmp_path, "WildCardLogging = true\nLogAuxSrc = true")
    found = entries(folder)
    assert [e.value for e in found if e.name == "LOGGER_DIRECTORY"] == [folder.name]
    assert next(e.value for e in found if e.name == "PLOGGER_STATUS").endswith(",LogAuxSrc=true")


@pytest.mark.parametrize(
    ("text", "logged"),
    [
        ("X", LoggedVariable("X", 2.0, False, True)),
        ("X @ 0 NOSYNC", LoggedVariable("X", 0.0, False, False)),
        ("X@0.2,nosync,MONITOR", LoggedVariable("X", 0.2, True, False)),
    ],
)
def test_log_lines(text, logged):
    assert parse_log_line(text) == logged


@pytest.mark.parametrize("text", ["", "@ 1", "X @ soon", "X @ -1", "X @", "X @ 1 SOMETIMES"])
def test_bad_log_lines_are_refused(text):
    with pytest.raises(ValueError, match="expected"):
        parse_log_line(text)


def test_sync_periods():
    assert [parse_sync(t) for t in ("true", "true @ 0.5", "true @ 0.01", "false")] == [1.0, 0.5, 0.1, 0.0]


def test_names_and_dates():
    assert log_stem("LOG_ABE", 1795393832.9, stamped=True, utc=True) == "LOG_ABE_23_11_2026_____00_30_32"
    assert log_date(0.0, utc=True) == "Thu Jan  1 00:00:00 1970"
    assert [copy_name(n) for n in ("targ_abe.bhv", "noext", ".hidden")] == [
        "targ_abe._bhv",
        "noext._",
        ".hidden._",
    ]


def test_spare_columns_go_to_the_first_new_doubles():
    table = SyncTable(["A"], spare=1)
    assert table.offer("B", 1.0) == "%%   (3) B\n"
    assert table.offer("C", 1.0) == ""
    table.offer("A", 2.0)
    assert table.row(0.66).splitlines()[-1].split() == ["0.66", "2", "1"]
    assert table.row(1.66).split() == ["1.66", "NaN", "NaN"]
    assert not table.wants("C")


def test_old_commands_left_in_the_database_are_ignored(tmp_path):
    host = Lockstep(0, tmp_path)
    home = host.add_community("abe")
    home.database.connect("old", host.clock.now())
    home.database.publish(
        "old", Message("LOGGER_RESTART", "x", host.clock.now() - 60.0, "old"), host.clock.now()
    )
    connection = LocalConnection(home.database, "pLogger", host.clock)
    host.add_app(home, Logger, AppContext("pLogger", "abe", host.clock, connection, log_dir=tmp_path,
                                          has_block=False, deterministic=True))  # fmt: skip
    host.run(2.0)
    host.stop()
    assert len([p for p in tmp_path.iterdir() if p.is_dir()]) == 1
