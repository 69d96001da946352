"""pLogger: writes what a community says to .alog, .slog, .xlog, .ylog and .blog files (community.md 12).

The app decides what goes where; the formats are `records.alog` and `log_format`, the disk is `log_files`.
One wildcard subscription at the database replaces the polling of the reference, so that nothing is lost and
nothing logged twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import ClassVar, NamedTuple

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App, AppContext
from pymoos_lite.apps.log_files import LogFolder, read_small_file
from pymoos_lite.apps.log_format import (
    SyncTable,
    binary_marker,
    copy_name,
    log_date,
    log_stem,
    print_ylog_row,
)
from pymoos_lite.config.parameters import Declaration, Parameter, parse_boolean, parse_number
from pymoos_lite.core.message import Message
from pymoos_lite.core.subscriptions import matches
from pymoos_lite.records.alog import AlogStyle, entry_printer, print_header

DIRECTORY_PERIOD = 10.0
MONITOR_PERIOD = 10.0
MAX_SKEW = 5.0
_NOTES = ("MOOS_DEBUG", "MOOS_SYSTEM")
_COMMANDS = ("LOGGER_RESTART", "PLOGGER_CMD")


class LoggedVariable(NamedTuple):
    """One `Log = NAME @ period, FLAGS` line."""

    name: str
    period: float
    monitor: bool
    sync: bool


def parse_log_line(text: str) -> LoggedVariable:
    """`NAV_X @ 0.2 NOSYNC, MONITOR`; the period is 2 seconds if it is not given. Raises ValueError."""
    head, at, tail = text.replace(",", " ").partition("@")
    words = head.split()
    rest = tail.split()
    if not words:
        raise ValueError("expected VAR @ PERIOD [, MONITOR] [, NOSYNC]")
    seconds = 2.0
    if at:
        try:
            seconds = parse_number(rest[0]) if rest else -1.0
        except ValueError:
            seconds = -1.0
        if seconds < 0.0:
            raise ValueError(f"'{tail.strip()}' is no period; expected seconds, 0 for every post")
    flags = [flag.upper() for flag in (*words[1:], *rest[1:])]
    unknown = [flag for flag in flags if flag not in ("MONITOR", "NOSYNC")]
    if unknown:
        raise ValueError(f"'{unknown[0]}' is no flag; expected MONITOR or NOSYNC")
    return LoggedVariable(words[0], seconds, "MONITOR" in flags, "NOSYNC" not in flags)


def parse_sync(text: str) -> float:
    """`true @ 0.5` as the period of the .slog, 0 for none. Raises ValueError."""
    word, at, period = (part.strip() for part in text.partition("@"))
    if not parse_boolean(word):
        return 0.0
    return max(0.1, parse_number(period)) if at else 1.0


def parse_patterns(text: str) -> list[str]:
    """Comma-separated variable patterns."""
    return [part.strip() for part in text.split(",") if part.strip()]


@mypyc_attr(allow_interpreted_subclasses=True)
class Logger(App):
    """The logger app; see the module."""

    DEFAULT_TICK = 5.0
    BLOCK_OPTIONAL = True
    OPEN_FOLDER: ClassVar[Callable[..., LogFolder]] = LogFolder
    PARAMETERS = Declaration(
        (
            Parameter("AsyncLog", "boolean", True, "", "Write the .alog, one line per post."),
            Parameter(
                "SyncLog",
                "custom",
                0.0,
                "s",
                "Write the .slog, a table: true [@ period].",
                parse=parse_sync,
                example="true @ 1",
            ),
            Parameter("File", "text", "MOOSLog", "", "Start of the names of folder and files."),
            Parameter("Path", "text", "./", "", "Where the folder goes; a global GLOBALLOGPATH goes first."),
            Parameter("FileTimeStamp", "boolean", True, "", "Put date and time behind the names."),
            Parameter("UTCLogDirectories", "boolean", False, "", "Stamp in UTC instead of local time."),
            Parameter(
                "LoggingDirectorySummaryFile",
                "text",
                "./.LastOpenedMOOSLogDirectory",
                "",
                "A file that names the folder in use.",
            ),
            Parameter(
                "Log",
                "custom",
                None,
                "",
                "Log a variable: VAR @ period [, MONITOR] [, NOSYNC].",
                repeated=True,
                parse=parse_log_line,
                example="NAV_X @ 0 NOSYNC",
            ),
            Parameter(
                "WildCardLogging", "boolean", False, "", "Log every variable (the default without a block)."
            ),
            Parameter(
                "WildCardPattern",
                "custom",
                None,
                "",
                "Restrict wildcard logging to these names: A,B*,C?.",
                repeated=True,
                parse=parse_patterns,
                example="NAV_*",
            ),
            Parameter(
                "WildCardOmitPattern",
                "custom",
                None,
                "",
                "Leave these out of wildcard logging.",
                repeated=True,
                parse=parse_patterns,
                example="*_STATUS",
            ),
            Parameter("WildCardExclusionLog", "boolean", False, "", "Write what was left out to the .xlog."),
            Parameter("LogAuxSrc", "boolean", False, "", "Show sources as app:aux."),
            Parameter("DoublePrecision", "integer", 5, "", "Decimals of numbers.", low=0, high=17),
            Parameter("MarkDataType", "boolean", False, "", "Put D: or S: before values."),
            Parameter(
                "MarkExternalCommunityMessages", "boolean", False, "", "Show where foreign messages are from."
            ),
            Parameter("CompressAlogs", "boolean", False, "", "Compress .alog and .xlog with gzip."),
            Parameter(
                "DynamicSyncLogColumns",
                "integer",
                0,
                "",
                "Spare columns of the .slog.",
                low=0,
                high=1000,
            ),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.folder: LogFolder | None = None
        self.stem = ""
        self.log_start = 0.0
        self.entries = 0
        self._logged: dict[str, LoggedVariable] = {}
        self._registered = False
        self._plain: set[str] = set()
        self._print: Callable[[Message], str] = str
        self._write_alog: Callable[[str], object] | None = None
        self._write_xlog: Callable[[str], object] | None = None
        self._write_ylog: Callable[[str], object] | None = None
        self._write_blog: Callable[[bytes], object] | None = None
        self._write_slog: Callable[[str], object] | None = None
        self._blog_size = 0
        self._sync: SyncTable | None = None
        self._next_row = 0.0
        self._next_directory = 0.0
        self._last_seen: dict[str, float] = {}

    # --- start ---------------------------------------------------------------------------------

    def on_start_up(self) -> None:
        config = self.config
        self.wildcard = config.wildcardlogging
        if "wildcardlogging" not in self.given and not self.context.has_block:
            self.wildcard = True
        for logged in config.log:
            if logged.name in self._logged:
                self.config_warning(f"Log = {logged.name}: was given before; the first line counts")
            self._logged.setdefault(logged.name, logged)
        self.accept = [p for group in config.wildcardpattern for p in group] or ["*"]
        self.omit = [p for group in config.wildcardomitpattern for p in group] or ["MISSION_FILE"]
        self._open()

    def on_connect(self) -> None:
        if self._registered:  # registrations outlive a lost connection; again would replay every value
            return
        self._registered = True
        for logged in self._logged.values():
            self.register(logged.name, logged.period)
        own = [name for name in (*_NOTES, *_COMMANDS) if name not in self._logged]
        for name in own:
            self.register(name)
        if self.wildcard:
            left_out = (*self._logged, *own)
            if not self.config.wildcardexclusionlog:
                left_out = (*left_out, *self.omit)
            for pattern in self.accept if not self.config.wildcardexclusionlog else ["*"]:
                self.register(pattern, omit=left_out)

    def _open(self) -> None:
        """Begin a new log: folder, files, headers."""
        context, config = self.context, self.config
        unix_time = self.now / self.clock.warp
        utc = config.utclogdirectories or context.deterministic
        self.stem = log_stem(config.file, unix_time, stamped=config.filetimestamp, utc=utc)
        folder = self._make_folder()
        self.folder, self.log_start = folder, self.now
        compress, banner = config.compressalogs, self._banner(unix_time, utc)
        self._write_alog = self._write_xlog = self._write_slog = self._sync = None
        if config.asynclog:
            self._write_alog = folder.open_text(f"{self.stem}.alog", compress=compress)
            self._write_alog(banner("alog", config.markdatatype))
            if config.wildcardexclusionlog:
                self._write_xlog = folder.open_text(f"{self.stem}.xlog", compress=compress)
        if config.synclog:
            columns = [v.name for v in self._logged.values() if v.sync]
            self._sync = SyncTable(columns, config.dynamicsynclogcolumns)
            self._write_slog = folder.open_text(f"{self.stem}.slog")
            self._write_slog(banner("slog", False) + self._sync.header())
            self._next_row = self.now + config.synclog
        self._write_ylog = folder.open_text(f"{self.stem}.ylog")
        self._write_ylog(banner("ylog", False))
        self._write_blog = folder.open_binary(f"{self.stem}.blog")
        self._blog_size = self.entries = 0
        self._last_seen = {v.name: self.now for v in self._logged.values() if v.monitor}
        self._next_directory = self.now
        home = self.community if config.markexternalcommunitymessages else ""
        style = AlogStyle(config.doubleprecision, config.logauxsrc, home, config.markdatatype)
        self._print = entry_printer(self.log_start, style)
        self._plain.clear()
        self._copy_mission(banner("_moos", False))

    def _banner(self, unix_time: float, utc: bool) -> Callable[[str, bool], str]:
        assert self.folder is not None
        # Equal runs have equal logs, wherever they are put: then only the name of the file is told.
        path = Path() if self.context.deterministic else self.folder.path
        date = log_date(unix_time, utc=utc)
        return lambda kind, marked: print_header(
            str(path / f"{self.stem}.{kind}"), date, self.log_start, marked=marked
        )

    def _make_folder(self) -> LogFolder:
        """The log folder at the best place there is: command line, GLOBALLOGPATH, Path, here."""
        context = self.context
        given = self.mission_global("GLOBALLOGPATH") or self.config.path or "."
        base = context.log_dir if context.log_dir is not None else Path(given).expanduser()
        fresh = context.deterministic and self.config.filetimestamp
        open_folder = type(self).OPEN_FOLDER
        try:
            return open_folder(base, self.stem, fresh=fresh)
        except OSError as refusal:
            text = (
                f"cannot write logs to {base} ({refusal.strerror or refusal}); they go to the current folder"
            )
            self.config_warning(text)
            return open_folder(Path(), self.stem, fresh=fresh)

    def _copy_mission(self, banner: str) -> None:
        name = self.context.mission_file
        if not name:
            return
        for path in (Path(name), self.context.mission_dir / Path(name).name):
            content = read_small_file(path)
            if content is not None:
                assert self.folder is not None
                self.folder.write_file(f"{self.stem}._moos", banner.encode() + content)
                return

    # --- mail ----------------------------------------------------------------------------------

    def on_mail(self, mail: list[Message]) -> None:
        plain, rows, print_entry = self._plain, [], self._print
        for message in mail:
            # Nearly every message is of a variable that simply goes to the .alog: nothing else to ask.
            if message[0] in plain and type(message[1]) is not bytes:
                rows.append(print_entry(message))
            elif self._take(message):
                rows.append(self._entry(message))
        if rows and self._write_alog is not None:
            self.entries += len(rows)
            self._write_alog("".join(rows))

    def _take(self, message: Message) -> bool:
        """Deal with a message that needs a decision; True if it (also) goes to the .alog."""
        name = message.name
        if self._write_ylog is not None and name in _NOTES:
            self._write_ylog(print_ylog_row(message, self.log_start))
        if name in _COMMANDS:
            self._obey(message)
        if name in self._last_seen:
            self._last_seen[name] = self.now
            self.retract_run_warning(self._missing(name))
        if self._sync is not None and type(message.value) is float:
            note = self._sync.offer(name, message.value)
            if note and self._write_slog is not None:
                self._write_slog(note)
        if not self._wanted(name):
            if self._write_xlog is not None and self._excluded(name):
                self._write_xlog(self._entry(message))
            return False
        tabled = self._sync is not None and self._sync.wants(name)
        if not (name in _NOTES or name in _COMMANDS or name in self._last_seen or tabled):
            self._plain.add(name)
        return True

    def _wanted(self, name: str) -> bool:
        if name in self._logged:
            return True
        if not self.wildcard or any(matches(p, name) for p in self.omit):
            return False
        return any(matches(p, name) for p in self.accept)

    def _excluded(self, name: str) -> bool:
        """Whether wildcard logging leaves out a variable that it knows of."""
        return self.wildcard and name not in _COMMANDS and name not in _NOTES

    def _entry(self, message: Message) -> str:
        value = message.value
        if not isinstance(value, bytes):
            return self._print(message)
        head = self._print(message._replace(value="")).rstrip().encode()
        offset = self._blog_size + len(head) + 1
        assert self._write_blog is not None
        self._write_blog(head + b" " + value + b"\n")
        self._blog_size = offset + len(value) + 1
        return self._print(message._replace(value=binary_marker(self.stem, offset, len(value))))

    def _obey(self, message: Message) -> None:
        if abs(self.now - message.time) > MAX_SKEW * self.clock.warp:
            return  # a command that was left lying in the database from before
        if message.name == "LOGGER_RESTART":
            self._close()
            self._open()
            self.event(f"log restarted in {self.stem}")
            return
        request, equals, argument = (part.strip() for part in message.text.partition("="))
        if equals and request.upper() == "COPY_FILE_REQUEST":
            self._copy(argument)
        elif equals and request.upper() == "LOG_REQUEST":
            try:
                logged = parse_log_line(argument)
            except ValueError as refusal:
                self.run_warning(f"PLOGGER_CMD {message.text[:80]}: {refusal}")
                return
            self._logged[logged.name] = logged
            self.register(logged.name, logged.period)
        else:
            text = f"PLOGGER_CMD {message.text[:80]}: expected LOG_REQUEST=... or COPY_FILE_REQUEST=..."
            self.run_warning(text)

    def _copy(self, name: str) -> None:
        path = self.mission_path(name)
        content = read_small_file(path)
        if content is None and not path.is_absolute():
            content = read_small_file(Path(name))
        if content is None:
            self.run_warning(f"COPY_FILE_REQUEST={name[:80]}: no such file, or larger than 32 MB")
            return
        assert self.folder is not None
        self.folder.write_file(copy_name(path.name), content)
        self.event(f"copied {path.name} into the log")

    # --- time ----------------------------------------------------------------------------------

    def iterate(self) -> None:
        now = self.now
        if self._sync is not None and now >= self._next_row and self._write_slog is not None:
            self._write_slog(self._sync.row(now - self.log_start))
            self._next_row = max(self._next_row + self.config.synclog, now)
        if now >= self._next_directory:
            self._next_directory = now + DIRECTORY_PERIOD
            self.notify("LOGGER_DIRECTORY", self._place())
            self._summarise()
        for name, seen in self._last_seen.items():
            if now - seen > MONITOR_PERIOD:
                self._last_seen[name] = now
                self.run_warning(self._missing(name))
                self.notify("MOOS_DEBUG", self._missing(name))
        if self.folder is not None and not self.context.deterministic:
            self.folder.flush()

    def _place(self) -> str:
        """The folder as others may know it: in lockstep two equal runs differ in it, not in its name."""
        if self.context.deterministic or self.folder is None:
            return self.stem
        return str(self.folder.path)

    @staticmethod
    def _missing(name: str) -> str:
        return f"monitored variable {name} has not been heard of for {MONITOR_PERIOD:g} s"

    def _summarise(self) -> None:
        name = self.config.loggingdirectorysummaryfile
        if self.context.deterministic or not name or self.folder is None:
            return
        try:
            self.folder.write_file(
                str(self.folder.path.parent.resolve() / name),
                f"LastOpenedLoggingDirectory={self.folder.path}\n".encode(),
            )
        except OSError as refusal:
            self.run_warning(f"cannot write {name}: {refusal.strerror or refusal}")

    # --- end -----------------------------------------------------------------------------------

    def on_quit(self) -> None:
        self.on_mail(self.connection.take_mail())
        self._close()

    def _close(self) -> None:
        if self.folder is not None:
            self.folder.close()
            self.folder = None

    def status_suffix(self) -> str:
        return f",LogAuxSrc={'true' if self.config.logauxsrc else 'false'}"

    def report(self) -> Iterable[str]:
        yield f"Folder:   {self._place()}"
        yield f"Wildcard: {'on' if self.wildcard else 'off'}, {len(self._logged)} variables by name"
        yield f"Entries:  {self.entries} in {self.now - self.log_start:.1f} s"
