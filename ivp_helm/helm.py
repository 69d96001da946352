"""The helm itself, without I/O: mail and the time go in, posts come out (helm.md 9.3).

    core = HelmCore(settings, content, find)
    core.start(now)
    core.deliver(mail, now); core.iterate(now); posts = core.take_posts()

What it decides and why stays in `trace` until the next iteration.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

from mypy_extensions import mypyc_attr

from ivp_helm import allstop
from ivp_helm.allstop import AllStop
from ivp_helm.announcer import Announcer, Count
from ivp_helm.authority import Authority
from ivp_helm.behavior_file import BehaviorFile
from ivp_helm.build import Finder
from ivp_helm.contacts import HelmContacts
from ivp_helm.decision import Verdict, decide
from ivp_helm.function_posts import post_functions, post_reasons
from ivp_helm.inbox import FIXED_VARIABLES, Inbox
from ivp_helm.info_buffer import InfoBuffer
from ivp_helm.ivp import Domain, IvPError, Solution, Variable
from ivp_helm.lifecycle import Life, Outcome
from ivp_helm.modes import ModeSet
from ivp_helm.outbox import HelmPost, Outbox
from ivp_helm.platform_model import Platform
from ivp_helm.population import Population
from ivp_helm.registrations import Registrations
from ivp_helm.settings import HelmSettings
from ivp_helm.summary import Timing
from ivp_helm.surroundings import Surroundings
from pymoos_lite.config.problems import Problem
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.geodesy import Geodesy

NAV_VARIABLES = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
_NOTED = frozenset({"BHV_WARNING", "BHV_EVENT", "BHV_ERROR"})
"""What behaviours say that a person should hear of."""
WAITING_FOR_NAV = "Waiting for Helm Nav Solution"
Stopwatch = Callable[[], float]


class Note(NamedTuple):
    """Something to tell a person: a run warning, the end of one, or an event."""

    kind: Literal["warning", "retract", "event"]
    text: str


class Trace(NamedTuple):
    """One iteration: who ran with what, what was solved, what came of it."""

    iteration: int
    now: float
    rounds: tuple[tuple[Life, Outcome], ...]
    solution: Solution | None
    decision: dict[str, float]
    reason: str
    modes: str


@mypyc_attr(allow_interpreted_subclasses=True)
class HelmCore:
    """See the module.

    `find` gives behaviour classes by type name. `problems` are errors of the configuration block that the
    caller found; together with those found here they make the helm refuse to drive (MALCONFIG).
    `stopwatch` measures CPU seconds (by default nothing), `listens` says whether anybody wants a variable.
    """

    def __init__(
        self,
        settings: HelmSettings,
        content: BehaviorFile,
        find: Finder,
        *,
        name: str = "pHelmIvP",
        problems: Sequence[Problem] = (),
        geodesy: Geodesy | None = None,
        seed: str | int | None = 0,
        stopwatch: Stopwatch = float,
        listens: Callable[[str], bool] = lambda variable: False,
    ) -> None:
        self.settings = settings
        self.content = content
        self.name = name
        self.listens = listens
        self.warning_count = 0
        """Configuration and run warnings so far; kept up to date by the app."""
        self.notes: list[Note] = []
        self.trace: Trace | None = None
        self.iteration = 0
        self.outbox = Outbox()
        self.authority = Authority(settings.start_in_drive, settings.allow_park, settings.standby)
        self._find = find
        self._stopwatch = stopwatch
        self.started = 0.0
        self.buffer = InfoBuffer()
        self.registrations = Registrations(self.buffer)
        found = list(problems)
        self.domain = self._domain(found)
        self._optional = {entry.variable.name for entry in settings.entries if entry.optional}
        self._desired = {name: _desired(settings.helm_prefix, name) for name in self.domain.names}
        self._nav = NAV_VARIABLES + (("NAV_DEPTH",) if "depth" in self.domain else ())
        self.platform = Platform(settings.turn_model)
        self.contacts = HelmContacts(
            settings.community, settings.contact_max_age, geodesy, settings.contact_extrapolation
        )
        self.surroundings = Surroundings(
            self.domain,
            self.buffer,
            settings.community,
            contacts=self.contacts.snapshot,
            platform=self.platform,
            random=random.Random(seed),
            comms_policy=settings.comms_policy,
            geodesy=geodesy,
        )
        self.inbox = Inbox(self)
        self._build(found)

    def _domain(self, problems: list[Problem]) -> Domain:
        try:
            domain = self.settings.domain()
        except IvPError as error:
            problems.append(Problem(self.content.file, 0, str(error)))
            domain = None
        if domain is None:
            if not problems:
                problems.append(Problem("", 0, "the helm has no Domain line, e.g. Domain = course:0:359:360"))
            domain = Domain([Variable("course", 0.0, 359.0, 360)])
        return domain

    def _build(self, found: Sequence[Problem]) -> None:
        self.modes = ModeSet(self.content.modes)
        self.population = Population(
            self.content.blocks, self._find, self.surroundings, self._stopwatch, self.settings.accept_retired
        )
        self.problems: tuple[Problem, ...] = (*found, *self.content.problems, *self.population.built.problems)
        self.authority.malconfig = any(p.severity == "error" for p in self.problems)
        self.allstop = AllStop()
        self.timing = Timing()
        self.announcer = Announcer(self)
        self._deferred = [i for i in self.content.initializations if i.deferred]
        self._start_posts: list[HelmPost] = []
        self._held = True
        self._nav_missing = True
        self._nav_warned = False
        self._referred: frozenset[str] = frozenset()
        self._referred_text = ""
        self._restart = ""
        self._restarted = False

    # --- starting -----------------------------------------------------------------------------------------

    def start(self, now: float) -> None:
        """Everything that happens before the first iteration."""
        self.started = self.buffer.now = now
        for name in FIXED_VARIABLES:
            self.registrations.want(name)
        if self.settings.other_override_var:
            self.registrations.want(self.settings.other_override_var)
        if self.authority.malconfig:
            return
        self._introduce()
        self._initialize(deferred=False)
        self._begin()

    def _introduce(self) -> None:
        post = self.outbox.post
        post("IVPHELM_DOMAIN", str(self.domain))
        post("IVPHELM_MODESET", self.modes.describe())
        if self.settings.helm_alias:
            post("IVPHELM_ALIAS", self.settings.helm_alias)
        self.announcer.introduce()

    def reintroduce(self) -> None:
        """The database was lost and found again: tell everything anew that it may have forgotten."""
        if self.authority.malconfig:
            return
        self.outbox.forget_everything()
        self.surroundings.retellings += 1
        self._introduce()
        self.announcer.refresh()
        if self.allstop.reason:
            self.outbox.post("IVPHELM_ALLSTOP", self.allstop.reason)

    def _initialize(self, deferred: bool) -> None:
        for entry in self.content.initializations:
            if entry.deferred == deferred and not (deferred and entry.variable in self.buffer):
                self.buffer.set(entry.variable, entry.value)
                self.outbox.post(entry.variable, entry.value, "HELM_VAR_INIT")

    def _begin(self) -> None:
        for behavior in self.population.built.order:
            for text in _guarded(behavior.on_helm_start):
                behavior.error(text)
            for item in behavior.take_posts():
                self.buffer.set(item.variable, item.value)
                self._start_posts.append(HelmPost(item.variable, item.value, "HELM_STARTUP_MSG"))
        for life in self.population:
            life.begin()
        self.population.announce_birth(self.started)
        for name in self.modes.variables():
            self.registrations.want(name)
        for entry in self._deferred:
            self.registrations.want(entry.variable)
        for template in self.population.templates:
            self.registrations.want(template.updates)
        self._register(self.population.lives)

    def take_registrations(self) -> list[str]:
        """Names to register for that were not handed out before."""
        names = self.registrations.take()
        for name in names:
            self.outbox.post("IVPHELM_REGISTER", name)
        return names

    def _register(self, changed: Sequence[Life]) -> None:
        """Behaviours are new, or had an update: hear what they need now, and know their contacts."""
        for life in changed:
            for name in life.behavior.variables_needed():
                self.registrations.want(name)
        self.announcer.note_variables(self.population.lives, changed)
        self._referred = frozenset(
            str(contact) for life in self.population if (contact := vars(life.behavior.config).get("contact"))
        )
        self._referred_text = ",".join(sorted(self._referred))

    # --- every round --------------------------------------------------------------------------------------

    def deliver(self, mail: Sequence[Message], now: float) -> None:
        """Mail since the last call."""
        self.inbox.take(mail, now)

    def take_posts(self) -> list[HelmPost]:
        """Everything to publish, in order."""
        return self.outbox.take()

    def take_notes(self) -> list[Note]:
        """What a person should hear."""
        notes = self.notes
        self.notes = []
        return notes

    def note(self, kind: Literal["warning", "retract", "event"], text: str) -> None:
        """Have a person hear of something."""
        self.notes.append(Note(kind, text))

    def be_replaced(self, by: str) -> None:
        """Another helm has taken over: stop, say so, and be silent from now on."""
        self.note("event", f"{by} is another helm in control: this one stops for good")
        self._announce(allstop.STANDBY_TOOK_OVER)

    def request_restart(self, kind: str) -> None:
        """Rebuild everything at the next iteration: ``type1`` without, ``type2`` with initial values."""
        if kind in ("type1", "type2"):
            self._restart = kind

    def iterate(self, now: float, cpu: float = 0.0) -> None:
        """One iteration at mission time `now`; `cpu` is the process's load in percent."""
        self.buffer.now = now
        if self._restart:
            self._rebuild()
        self._release_start_posts()
        post = self.outbox.post
        if self.authority.watch(now):
            self.note("event", "The primary helm is silent: this stand-by helm takes over")
            self._introduce()
        if self.authority.disabled:
            self.outbox.post_change("IVPHELM_STATE", self.authority.state)
            self.buffer.clear_deltas()
            return
        post("IVPHELM_CPU", cpu)
        post("IVPHELM_STATE", self.authority.state)
        if not self.authority.awake:
            self.buffer.clear_deltas()
            return
        if self._nav_missing and not self._nav_arrived(now):
            return
        if self._deferred and self.inbox.heard_own_state:
            self._initialize(deferred=True)
            self._deferred.clear()
        self.contacts.refresh(now, self._referred)
        if self._referred:
            post("IVPHELM_CONTACT_SUMMARY", self._referred_text)
        post("IVPHELM_LEDGER_SUMMARY", self.contacts.summary())
        if not self.authority.driving:
            self._announce(allstop.MANUAL_OVERRIDE)
            self.buffer.clear_deltas()
            return
        if now - self.started < self.settings.settle:
            return
        self._drive(now)
        self.buffer.clear_deltas()

    def _rebuild(self) -> None:
        kind, self._restart = self._restart, ""
        for name in {post.behavior for post in self.outbox.newest()}:
            self.outbox.forget_behavior(name)
        self._build([p for p in self.problems if p.file not in (self.content.file,)])
        if self.authority.malconfig:
            return
        self._introduce()
        if kind == "type2":
            self._initialize(deferred=False)
        self._begin()
        self._restarted = True

    def _release_start_posts(self) -> None:
        if self._held and self.inbox.clients.issuperset(self.settings.hold_on_apps):
            self._held = False
            self.outbox.posts += self._start_posts
            self._start_posts = []

    def _nav_arrived(self, now: float) -> bool:
        if all(name in self.buffer for name in self._nav):
            self._nav_missing = False
            if self._nav_warned:
                self.note("retract", WAITING_FOR_NAV)
            return True
        if not self._nav_warned and now - self.started > self.settings.nav_grace:
            self._nav_warned = True
            self.note("warning", WAITING_FOR_NAV)
        return False

    # --- driving ------------------------------------------------------------------------------------------

    def _drive(self, now: float) -> None:
        self.iteration += 1
        buffer = self.buffer
        outbox = self.outbox
        surroundings = self.surroundings
        surroundings.refresh_own()
        if surroundings.own is not None:
            self.platform.update(surroundings.own, now)
        outbox.post("TURN_RATE", self.platform.turn_rate)
        if self._restarted:
            self._restarted = False
            outbox.post("IVPHELM_RESTARTED", "true")
        if self.population.templates:
            newcomers = self.population.spawn(now, self.started, self.iteration)
        else:
            newcomers = []
        modes = self.modes.evaluate(buffer)
        rounds, verdict, solve_seconds = self._run_and_solve()
        count = Count.of(rounds)
        if newcomers or count.updates:
            self._register([life for life in self.population.lives if life.results or life in newcomers])
        for variable, mode in modes.items():
            outbox.post_change(variable, mode, "HELM_MODE")
        decision, complaint = verdict.decision, verdict.complaint
        reason = self._reason(count, verdict)
        self.timing = self.timing.after(count.build_seconds, solve_seconds)
        self.announcer.before_posts(rounds, count)
        if self.listens("BHV_IPF"):
            post_functions(outbox, rounds, self.iteration)
        if self.listens("BHV_WHY"):
            post_reasons(outbox, rounds)
        self._drain(rounds)
        self._bury(now)
        self.announcer.after_posts(rounds, count, decision if reason == allstop.CLEAR else {}, complaint)
        self._announce(reason)
        if reason == allstop.CLEAR:
            for name, value in decision.items():
                outbox.post(self._desired[name], value)
        self.trace = Trace(
            self.iteration, now, tuple(rounds), verdict.solution, decision, reason, self.modes.summary()
        )

    def _run_and_solve(self) -> tuple[list[tuple[Life, Outcome]], Verdict, float]:
        """All behaviours in order, then the solver; filter-level behaviours see its first answer."""
        rounds: list[tuple[Life, Outcome]] = []
        late = []
        for life in self.population.lives:
            if life.behavior.FILTER_LEVEL > 0:
                late.append(life)
            else:
                rounds.append((life, life.iterate()))
        began = self._stopwatch()
        verdict = decide(self.domain, rounds)
        seconds = self._stopwatch() - began
        if late:
            for name, value in verdict.decision.items():
                self.buffer.assign(f"{self._desired[name]}_UNFILTERED", value)
            rounds += [(life, life.iterate()) for life in late]
            began = self._stopwatch()
            verdict = decide(self.domain, rounds)
            seconds += self._stopwatch() - began
        return rounds, verdict, seconds

    def _reason(self, count: Count, verdict: Verdict) -> str:
        """The all-stop reason, or CLEAR."""
        timeout = self.settings.nav_timeout
        if verdict.complaint:
            return allstop.BEHAVIOR_ERROR
        if timeout > 0.0 and any((self.buffer.age(name) or 0.0) > timeout for name in self._nav):
            return allstop.STALE_NAV
        if not count.functions:
            return allstop.NOTHING_TO_DO
        if self.settings.goals_mandatory and not count.goal:
            return allstop.NO_GOAL
        if len(verdict.decision) == len(self.domain):
            return allstop.CLEAR
        missing = [n for n in self.domain.names if n not in verdict.decision and n not in self._optional]
        return f"{allstop.MISSING}:{','.join(missing)}" if missing else allstop.CLEAR

    def _drain(self, rounds: Sequence[tuple[Life, Outcome]]) -> None:
        """Everything behaviours posted, in their order."""
        drain = self.outbox.drain
        for life, _ in rounds:
            behavior = life.behavior
            posts = behavior.take_posts()
            for post in posts:
                if post.variable in _NOTED:
                    if post.variable == "BHV_WARNING":
                        self.note("retract" if post.retracts else "warning", str(post.value))
                    else:
                        self.note("event", str(post.value))
            drain(posts, behavior.name, self.buffer, self.iteration)

    def _bury(self, now: float) -> None:
        """Remove the completed behaviours, after their posts went out."""
        dead = self.population.bury(now, self.started, self.iteration)
        for life in dead:
            self.outbox.forget_behavior(life.name)
        self.announcer.deaths(len(dead))

    def _announce(self, reason: str) -> None:
        """Say why the vehicle is stopped, or that it is not; zeros where the rules ask for them."""
        former = self.allstop.reason
        told = self.allstop.update(reason)
        if told.reason:
            self.outbox.post("IVPHELM_ALLSTOP", reason)
            self.outbox.post("MOOS_DEBUG", f"pHelmIvP AllStop: {reason}")
            if reason != former:
                self.note("event", f"All-stop: {reason}" if reason != allstop.CLEAR else "Driving")
        if told.zeros:
            for variable in self._desired.values():
                self.outbox.post(variable, 0.0)
            if self.settings.park_on_allstop and reason != allstop.MANUAL_OVERRIDE:
                self.authority.park()
        if reason.startswith(allstop.MISSING):
            self.outbox.post("BHV_ERROR", reason)


def _desired(prefix: str, variable: str) -> str:
    word = "HEADING" if variable == "course" else variable.upper()
    return f"{prefix}DESIRED_{word}"


def _guarded(hook: Callable[[], None]) -> list[str]:
    """What is wrong when a hook raises, nothing when it does not."""
    try:
        hook()
    except Exception as error:
        return [f"{getattr(hook, '__name__', 'a hook')} raised {type(error).__name__}: {error}"]
    return []
