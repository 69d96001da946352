"""One behaviour in one helm iteration: updates, state, hooks and flags in the order of helm.md 5.2.

The helm keeps a `Life` per behaviour. It calls the author's hooks, catches what they raise and turns it
into an error of that behaviour: the vehicle stops and is told why, the other behaviours go on.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mypy_extensions import mypyc_attr

from ivp_helm.behavior import Behavior, BehaviorError
from ivp_helm.duration import DurationClock
from ivp_helm.flags import Flag
from ivp_helm.ivp import IvPError, IvPFunction
from ivp_helm.surroundings import MissingOwnship
from ivp_helm.updates import UpdateResult, apply_update, is_repeatable, seconds_text

RUNNING = ("running", "active")
Hook = Callable[[], Any]


class Outcome:
    """What one iteration of one behaviour came to.

    `blocked` says why it did not run: the first condition that failed, starvation, a domain that lacks
    its variables, its duration. `reused` marks a function carried over from the last iteration. `failed`: it posted
    an error, or raised, and the helm stops the vehicle.
    """

    # No tuple: compiled, a class of its own is made and read in half the time, and there are many.
    __slots__ = ("blocked", "build_seconds", "failed", "function", "reused", "state")

    def __init__(
        self,
        state: str,
        function: IvPFunction | None = None,
        reused: bool = False,
        blocked: str = "",
        build_seconds: float = 0.0,
        failed: bool = False,
    ) -> None:
        self.state = state
        self.function = function
        self.reused = reused
        self.blocked = blocked
        self.build_seconds = build_seconds
        self.failed = failed


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Origin:
    """Where a behaviour comes from: its type in the mission file, the template's name if it was
    spawned, and the update that spawned it (``helm_startup`` for those of the file)."""

    kind: str
    prefix: str = ""
    seed: str = "helm_startup"


class Life:
    """A behaviour's passage through states, with its clocks, counters and updates.

    `stopwatch` gives CPU or wall seconds for measuring what building functions costs; a core without
    clocks has one that stands still.
    """

    def __init__(self, behavior: Behavior, origin: Origin, stopwatch: Callable[[], float] = float) -> None:
        self.behavior = behavior
        self.origin = origin
        self.state = ""
        self.entered = behavior.now
        """Mission time at which it entered its state."""
        self.updates_good = 0
        self.updates_total = 0
        self.results: list[UpdateResult] = []
        """Updates of this iteration."""
        self.disabled = False
        self.told_why = ""
        """The reason last published."""
        self.duration = DurationClock(behavior.config.duration, behavior.config.duration_idle_decay)
        self._stopwatch = stopwatch
        self._last_update = ""
        self._skip: str | None = None
        self._flags_armed = True
        self._last_time = behavior.now
        self._reset_stamp = -1.0
        self._raw: object = None
        self._completion_told = False
        self._status_key: tuple[object, ...] = ()
        self._keep_parameters()
        self._missing = [v for v in type(behavior).VARIABLES if v not in behavior.domain]
        own = self._own_hook
        self._on_every_state = own("on_every_state")
        self._on_idle = own("on_idle")
        self._on_inactive = own("on_inactive")

    @property
    def name(self) -> str:
        return self.behavior.name

    def _keep_parameters(self) -> None:
        """Keep the parameters that each iteration asks for: reading them off `config` is dearer."""
        config = self.behavior.config
        self._updates: str = config.updates
        self._duration_reset: tuple[str, float | str | None] | None = config.duration_reset
        self._duration_status: str = config.duration_status
        self._nostarve: list[tuple[tuple[str, ...], float]] = config.nostarve
        self._runxflag: list[Flag] = config.runxflag
        self.counts = f"{self.updates_good}/{self.updates_total}" if self._updates else "n/a"
        """``good/total`` updates, ``n/a`` without an updates variable."""

    # --- beginning ----------------------------------------------------------------------------------------

    def begin(self) -> None:
        """The parameters are complete; for one spawned at run time also `on_spawn` and its flags."""
        self.behavior.follow_comms_policy(self.behavior.surroundings.comms_policy)
        self._parameters_complete()
        behavior = self.behavior
        if behavior.spawned:
            self._call(behavior.on_spawn)
            behavior.post_flags(behavior.config.spawnflag)
            # Its spawning text is its first update; the helm applied it on building.
            self._skip = self._last_update = self.origin.seed
            self.updates_good = self.updates_total = 1
            self._keep_parameters()

    # --- one iteration ------------------------------------------------------------------------------------

    def iterate(self) -> Outcome:
        """Steps 1 to 13 of helm.md 5.2. Never raises."""
        behavior = self.behavior
        try:
            outcome = self._iterate()
        except Exception as error:  # a plug-in's macro, for instance
            behavior.error(describe_raise("the behavior", error))
            outcome = Outcome(self.state or "idle")
        if behavior.failed:
            behavior.failed = False
            outcome.function = None
            outcome.failed = True
        return outcome

    def _iterate(self) -> Outcome:
        behavior = self.behavior
        config = behavior.config
        now = behavior.now
        former = self.state
        buffer = behavior.buffer
        behavior.iteration += 1
        if self._updates and buffer.has_deltas(self._updates):
            self._check_updates()
        if self._duration_reset is not None:
            self._check_duration_reset(self._duration_reset)
        if buffer.updated("COMMS_POLICY"):
            behavior.follow_comms_policy(buffer.text("COMMS_POLICY") or "")
        state, blocked = self._decide(now)
        if self._on_every_state is not None:
            self._call(self._on_every_state)
        if state == "completed":
            self._complete_once()
        if self._flags_armed:
            self._flags_armed = False
            behavior.post_flags(config.configflag, repeat=False)
        function: IvPFunction | None = None
        reused = False
        seconds = 0.0
        if state == "running":
            function, reused, seconds = self._run(former, now)
            if function is not None or reused:
                state = "active"
        elif state == "idle":
            self._idle(former, now)
        elif state == "disabled":
            self._disable(former)
        if behavior.completed and state != "completed":
            state = "completed"
            self._complete_once()
        self._post_status(state, blocked, function)
        if state != former:
            self.entered = now
            if not former:
                behavior.post_flags(config.spawnxflag)
        self.state = behavior.state = state
        if function is None:
            self._raw = None
        self._last_time = now
        return Outcome(state, function, reused, blocked, seconds)

    def _decide(self, now: float) -> tuple[str, str]:
        """State by helm.md 5.1, and why it is not to run."""
        behavior = self.behavior
        if behavior.completed:
            return "completed", ""
        if behavior.spawned and behavior.lost_its_contact() and self._complete("contact lost"):
            return "completed", ""
        if self.disabled:
            return "disabled", ""
        failed = behavior.conditions.first_false(behavior.buffer)
        if failed is not None:
            return "idle", failed.text
        clock = self.duration
        if clock.limit >= 0.0:
            clock.run(now)
            if clock.over(now):
                self._post_remaining(now)
                if self._complete():
                    return "completed", "completed-byduration"
                clock.reset()
                clock.run(now)
        if self._missing:
            behavior.error(f"the helm's Domain has no {' and no '.join(self._missing)}")
            return "idle", "null-domain"
        if self._nostarve:
            starved = self._starved()
            if starved:
                return "idle", starved
        return "running", ""

    def _run(self, former: str, now: float) -> tuple[IvPFunction | None, bool, float]:
        """Function, whether it is the former one again, and what building it cost."""
        behavior = self.behavior
        config = behavior.config
        starting = former not in RUNNING
        if self._duration_status:
            self._post_remaining(now)
        if starting:
            self._call(behavior.on_idle_to_run)
        behavior.relevance = 1.0
        stopwatch = self._stopwatch
        began = stopwatch()
        raw = self._call(behavior.on_run)
        seconds = stopwatch() - began
        if starting:
            behavior.post_flags(config.runflag)
        if self._runxflag:
            behavior.post_flags(self._runxflag)
        reused = raw is not None and raw is self._raw
        function = self._weigh(raw) if raw is not None else None
        self._raw = raw
        if function is not None:
            if former != "active":
                behavior.post_flags(config.activeflag)
        else:
            if former == "active":
                behavior.post_flags(config.inactiveflag)
            if self._on_inactive is not None:
                self._call(self._on_inactive)
        if not starting:
            behavior.run_time += now - self._last_time
        return function, reused and function is not None, seconds

    def _weigh(self, raw: object) -> IvPFunction | None:
        behavior = self.behavior
        if raw is None or behavior.failed:
            return None
        if not isinstance(raw, IvPFunction):
            behavior.error(f"on_run returned {type(raw).__name__}; expected an IvPFunction or None")
            return None
        weight = float(behavior.config.pwt) * behavior.relevance
        if not weight > 0.0:
            return None
        try:
            return raw.weighted(weight, behavior.name)
        except IvPError as error:
            behavior.error(str(error))
            return None

    def _idle(self, former: str, now: float) -> None:
        behavior = self.behavior
        if former != "idle":
            behavior.post_flags(behavior.config.idleflag)
            behavior.post_flags(behavior.config.inactiveflag)
            if former in RUNNING:
                self._call(behavior.on_run_to_idle)
        if self._on_idle is not None:
            self._call(self._on_idle)
        if former == "idle":
            behavior.idle_time += now - self._last_time
            self.duration.idle(now - self._last_time)

    def _disable(self, former: str) -> None:
        behavior = self.behavior
        if former in RUNNING:
            behavior.post_flags(behavior.config.inactiveflag)
            self._call(behavior.on_run_to_idle)
        self._call(behavior.on_disabled)

    # --- parts --------------------------------------------------------------------------------------------

    def _check_updates(self) -> None:
        behavior = self.behavior
        texts = behavior.buffer.delta_texts(behavior.config.updates)
        if not texts:
            return
        applied = False
        for text in texts:
            if not text.strip():
                continue
            if text == self._skip:
                self._skip = None
                self.results.append(UpdateResult(self.name, behavior.config.updates, "success", text))
                continue
            if text == self._last_update and not is_repeatable(text):
                self.results.append(UpdateResult(self.name, behavior.config.updates, "duplicate", text))
                continue
            result = self._guarded(apply_update, behavior, text, self.origin.prefix)
            if result is None:
                continue
            self.results.append(result)
            if result.result == "name_mismatch":
                continue
            self.updates_total += 1
            applied = True
            if result.bad:
                complaint = f"Faulty update for behavior: {self.name}. Bad parameter(s): " + ",".join(
                    key for key, _ in result.bad
                )
                behavior.warn(complaint)
                behavior.post("BHV_CONFIG_WARNING", complaint, repeat=True)
                for _, reason in result.bad:
                    behavior.event(reason)
            else:
                self.updates_good += 1
                self._last_update = text
                self._flags_armed = True
        self._skip = None
        if applied:
            self.duration.limit = behavior.config.duration
            self.duration.idle_decay = behavior.config.duration_idle_decay
            self._parameters_complete()

    def _parameters_complete(self) -> None:
        behavior = self.behavior
        self._keep_parameters()
        self._call(behavior.resolve_conditions)
        self._call(behavior.on_parameters)
        settings = self._call(behavior.settings)
        if settings:
            behavior.post("BHV_SETTINGS", f"type={self.origin.kind},name={self.name},{settings}")

    def _check_duration_reset(self, reset: tuple[str, float | str | None]) -> None:
        name, wanted = reset
        buffer = self.behavior.buffer
        stamp = buffer.stamp(name)
        if stamp is None or stamp <= self._reset_stamp:
            return
        value = buffer.value(name)
        if (
            wanted is not None
            and value != wanted
            and (not isinstance(wanted, float) or buffer.number(name) != wanted)
        ):
            return
        self._reset_stamp = stamp
        if self.duration.started is not None:
            self.duration.reset()
        if self._duration_status and self.duration.limit >= 0.0:
            self._post_remaining(self.behavior.now)

    def _post_remaining(self, now: float) -> None:
        variable = self._duration_status
        if not variable or self.duration.limit < 0.0:
            return
        remaining = self.duration.remaining(now)
        if remaining > 10.0:
            self.behavior.post_int(variable, remaining)
        else:
            self.behavior.post(variable, round(remaining, 9))

    def _starved(self) -> str:
        buffer = self.behavior.buffer
        for names, seconds in self._nostarve:
            for name in names:
                age = buffer.age(name)
                if age is None or age > seconds:
                    shown = -1.0 if age is None else age
                    return f"VarStarve: {name}(stime:{seconds_text(seconds)}) (itime:{seconds_text(shown)})"
        return ""

    def _complete(self, reason: str = "") -> bool:
        """Complete the behaviour; False if it is perpetual and lives on."""
        self._guarded(self.behavior.complete, reason)
        return self.behavior.completed

    def _complete_once(self) -> None:
        if not self._completion_told:
            self._completion_told = True
            self._call(self.behavior.on_complete)

    def _post_status(self, state: str, blocked: str, function: IvPFunction | None) -> None:
        # What the text is made of, and nothing that has to be worked out: functions are immutable.
        weight = function.weight if function is not None else None
        pieces = function.pieces if function is not None else None
        retellings = self.behavior.surroundings.retellings
        key = (state, blocked, weight, pieces, self.updates_total, self.updates_good, retellings)
        if key == self._status_key:
            return  # the outbox would drop it
        self._status_key = key
        text = f"name={self.name}"
        if blocked:
            text += f",pc={blocked}"
        if function is not None:
            text += f",pwt={function.weight:.5f},pcs={function.pieces}"
        self.behavior.post("BHV_STATUS", f"{text},state={state},updates={self.counts}")

    # --- guarding the helm --------------------------------------------------------------------------------

    def _own_hook(self, name: str) -> Hook | None:
        """The hook if the class fills it in."""
        if getattr(type(self.behavior), name) is getattr(Behavior, name):
            return None
        hook: Hook = getattr(self.behavior, name)
        return hook

    def _call(self, hook: Hook) -> Any:
        """What the hook returns; None, and an error of the behaviour, if it raises."""
        try:
            return hook()
        except (MissingOwnship, BehaviorError) as error:
            self.behavior.error(str(error))
        except Exception as fault:
            self.behavior.error(describe_raise(getattr(hook, "__name__", "a hook"), fault))
        return None

    def _guarded(self, function: Callable[..., Any], *arguments: object) -> Any:
        return self._call(lambda: function(*arguments))


def describe_raise(where: str, error: Exception) -> str:
    """One line on what a plug-in raised, with the file name and line it came from."""
    frames = traceback.extract_tb(error.__traceback__)
    spot = ""
    if frames:
        file = frames[-1].filename.replace("\\", "/").rpartition("/")[2]
        spot = f" ({file}:{frames[-1].lineno})"
    text = " ".join(str(error).split())
    return f"{where} raised {type(error).__name__}: {text}{spot}"
