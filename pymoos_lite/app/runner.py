"""Runs one app: ticks, mail, iteration, status and reports, the same in every host.

The runner holds no thread and never sleeps. A host asks `next_deadline`, calls `step` when it has
come (or when mail came, if `wakes_on_mail`), and catches what the app raises.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Protocol

from pymoos_lite.app.base import App
from pymoos_lite.core.message import Message
from pymoos_lite.records.appcast import AppCast, AppCastRequest, LoadCastRequest
from pymoos_lite.records.csp import RecordError

STATUS_PERIOD = 2.0
"""Mission seconds between two `<APP>_STATUS` posts."""

MAX_REQUESTERS = 100
FREE_RUNNING_RATE = 1000.0
"""Rate (Hz, mission time) of an app that asks to run flat out; virtual time needs some bound."""


class Meter(Protocol):
    """What a host can say about the cost of an app."""

    def cpu_load(self) -> float:
        """Percent of one core since the last call."""
        ...

    def memory_kb(self) -> tuple[int, int]:
        """Resident memory now and at its highest, in kilobytes."""
        ...


class NoMeter:
    """Costs that are the same in every run: none. Lockstep runs must not differ by them."""

    def cpu_load(self) -> float:
        return 0.0

    def memory_kb(self) -> tuple[int, int]:
        return 0, 0


class Listing:
    """Names as a text, a comma after each; made anew only when they have changed."""

    def __init__(self) -> None:
        self._names: tuple[str, ...] = ()
        self._text = ""

    def text(self, names: tuple[str, ...]) -> str:
        """The names as they are now; told fastest by the very object of the time before."""
        if names is not self._names:
            self._names = names
            self._text = "".join([f"{name}," for name in names])
        return self._text


class AppRunner:
    """One app's life from start-up to quitting."""

    def __init__(self, app: App, meter: Meter | None = None) -> None:
        self.app = app
        self.name = app.name
        self._bind()
        self.meter = meter or NoMeter()
        rate = app.tick_rate
        self.period = 1.0 / rate if rate > 0.0 else 1.0 / FREE_RUNNING_RATE
        self.mode = app.config.iteratemode if app.config.iteratemode in (0, 1, 2) else 0
        if type(app).MAIL_DRIVEN and "iteratemode" not in app.given:
            self.mode = 2
        max_rate = app.config.maxapptick
        self._min_gap = 1.0 / max_rate if max_rate > 0.0 else 0.0
        self._command = f"{app.name.upper()}_CMD" if app.config.catchcommandmessages else ""
        self._special = frozenset({"APPCAST_REQ", "LOADCAST_REQ", self._command})
        self._sort = bool(app.config.sortmailbytime)
        self._was_connected = False
        self.next_iteration = self._anchor = 0.0
        """Mission time of the next tick; `step` moves it."""
        self._ticks = 0
        self._last_iteration = float("-inf")
        self._next_status = 0.0
        self._last_report = float("-inf")
        self._requests: dict[str, AppCastRequest] = {}
        self._request_ends: dict[str, float] = {}
        self._load_until = float("-inf")
        self._published = Listing()
        self._registered = Listing()
        self.wakes_on_mail = self.mode != 0
        """Whether the app wants its mail (and in mode 1 an iteration) before the next tick."""

    def start(self, now: float, delay: float = 0.0) -> None:
        """Run the app's start-up; what it raises is the host's to report. Ticks begin after `delay` seconds."""
        app = self.app
        app.now = app.started = now
        self.next_iteration = self._anchor = now + delay
        self._next_status = now
        context = app.context
        if not context.community:
            app.config_warning("Community/Vehicle name not found in mission file")
        if not context.has_block and not app.BLOCK_OPTIONAL:
            app.config_warning(f"No mission config block found for {app.name}")
        app.on_start_up()
        self._bind()  # again: starting up may have put others in their place

    def _bind(self) -> None:
        """Look up the hooks that every step calls."""
        self._iterate: Callable[[], None] = self.app.iterate
        self._on_mail: Callable[[list[Message]], None] = self.app.on_mail

    def next_deadline(self) -> float:
        """Mission time at which `step` is next due (in mode 1 waiting mail may bring it forward)."""
        if self.mode == 1 and self.app.connection.mail:
            return min(self.next_iteration, self._last_iteration + self._min_gap)
        return self.next_iteration

    def has_input(self, now: float) -> bool:
        """Whether something has come that should not wait for the next tick."""
        app = self.app
        if app.connection.mail and self.mail_due(now):
            return True
        return any(port.has_data for port in app.ports)

    def mail_due(self, now: float) -> bool:
        """Whether waiting mail may be handed over now rather than at the next tick."""
        return self.mode == 2 or (self.mode == 1 and now - self._last_iteration >= self._min_gap)

    def step(self, now: float) -> None:
        """Do what is due at mission time `now`: connect, mail, iterate, report.

        Raises:
            Quit: the app is done.
            Exception: whatever else the app raised.
        """
        app = self.app
        app.now = now
        connection = app.connection
        connected = connection.connected
        if connected is not self._was_connected:
            self._was_connected = connected
            if connected:
                self._on_connect()
        due = iterates = now >= self.next_iteration
        waiting = connection.mail
        if waiting and (due or self.mail_due(now)):
            iterates = due or self.mode == 1
            mail = waiting.copy()
            waiting.clear()
            special = self._special
            for message in mail:
                if message[0] in special:
                    mail = self._take_special(mail)
                    break
            if mail:
                if self._sort:
                    mail.sort(key=_time_of)
                self._on_mail(mail)
        if app.ports:
            for port in tuple(app.ports):  # the app may open or close some on the way
                if port.has_data:
                    app.on_datagrams(port, port.receive())
        if connection.notices:
            for notice in connection.take_notices():
                app.run_warning(notice)
        if not iterates:
            return
        if connected:
            app.iteration += 1
            if now < self._load_until:
                self._iterate_measured(now)
            else:
                self._iterate()
            self._last_iteration = now
            if now >= self._next_status:
                self._next_status = now + STATUS_PERIOD
                app.notify(f"{app.name.upper()}_STATUS", self._status(now))
            if self._requests or app.iteration <= 2 or app.log.fresh_config_warning:
                self._report(now)
        # Counted from an anchor, so that ticks neither drift nor pile up rounding; an overrun
        # is not caught up (community.md 7.2).
        self._ticks = ticks = self._ticks + 1
        self.next_iteration = following = self._anchor + ticks * self.period
        if following <= now or self.mode == 1:
            self._anchor, self._ticks = now, 1
            self.next_iteration = now + self.period

    def finish(self, now: float) -> None:
        """End the app in an orderly way."""
        self.app.now = now
        try:
            self.app.on_quit()
        finally:
            self.app.close_ports()

    # --- inside ------------------------------------------------------------------------------

    def _on_connect(self) -> None:
        app = self.app
        for name in ("APPCAST_REQ", "LOADCAST_REQ"):
            app.register(name)
        if self._command:
            app.register(self._command)
        app.on_connect()

    def _take_special(self, mail: list[Message]) -> list[Message]:
        """Act on requests and commands; returns the mail that is the app's own."""
        app = self.app
        kept: list[Message] = []
        command = self._command
        for message in mail:
            name = message.name
            if name == "APPCAST_REQ":
                self._on_appcast_request(message.text)
            elif name == "LOADCAST_REQ":
                self._on_loadcast_request(message.text)
            elif name == command:
                app.on_command(message)
            else:
                kept.append(message)
        return kept

    def _iterate_measured(self, now: float) -> None:
        """Iterate, and tell who asked (LOADCAST_REQ) how long it took and how long ago the last time was."""
        app = self.app
        began = app.clock.now()
        self._iterate()
        length = (app.clock.now() - began) * app.tick_rate
        gap = (now - self._last_iteration) * app.tick_rate
        upper = app.name.upper()
        if app.iteration > 1:
            app.notify(f"{upper}_ITER_GAP", gap)
        app.notify(f"{upper}_ITER_LEN", length)

    def _status(self, now: float) -> str:
        memory, peak = self.meter.memory_kb()
        app = self.app
        connection = app.connection
        published = self._published.text(connection.published_names())
        subscribed = self._registered.text(connection.registered_names())
        return (
            f"AppErrorFlag=false,Uptime={now - app.started:.6g},cpuload={self.meter.cpu_load():.4g},"
            f"memory_kb={memory},memory_max_kb={peak},MOOSName={app.name},"
            f'Publishing="{published}",Subscribing="{subscribed}"{app.status_suffix()}'
        )

    # --- reports -----------------------------------------------------------------------------

    def _on_appcast_request(self, text: str) -> None:
        try:
            request = AppCastRequest.parse(text)
        except RecordError:
            return
        app = self.app
        if not request.asks(app.community, app.name):
            return
        self._requests[request.key] = request
        self._request_ends[request.key] = app.now + request.duration
        while len(self._requests) > MAX_REQUESTERS:  # a flood of keys must not grow without bound
            oldest = next(iter(self._requests))
            del self._requests[oldest], self._request_ends[oldest]

    def _on_loadcast_request(self, text: str) -> None:
        try:
            request = LoadCastRequest.parse(text)
        except RecordError:
            return
        if request.asks(self.app.name):
            self._load_until = self.app.now + request.duration

    def _report(self, now: float) -> None:
        app = self.app
        for key in [k for k, end in self._request_ends.items() if now > end]:
            del self._requests[key], self._request_ends[key]
        if (now - self._last_report) / app.clock.warp < app.config.term_report_interval:
            return
        log = app.log
        wanted = app.iteration <= 2 or log.fresh_config_warning
        for request in self._requests.values():
            if request.thresh == "any" or log.fresh_run_warning:
                wanted = True
        if not wanted:
            return
        self._last_report = now
        app.notify("APPCAST", self.cast().to_text())
        log.fresh_run_warning = log.fresh_config_warning = False

    def cast(self) -> AppCast:
        """The app's report as it stands."""
        app = self.app
        log = app.log
        return AppCast(
            proc=app.name,
            node=app.community,
            iteration=app.iteration,
            messages=tuple(line for part in app.report() for line in str(part).split("\n")),
            config_warnings=tuple(log.config_warnings),
            events_total=log.events_total,
            events=tuple(f"[{age:.2f}]: {text}" for age, text in log.events),
            run_warning_total=log.run_warnings_total,
            run_warnings=tuple(sorted(log.run_warnings.items())),
        )


_time_of = itemgetter(2)
