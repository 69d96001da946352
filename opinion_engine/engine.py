"""One agent's opinion engine: inputs and neighbour messages in, opinions and postings out (gcid.md 6, 7).

Knows no socket, file or clock: `now` is always an argument, in mission seconds. Whatever arrives from
neighbours, in any order, duplicated, lost or damaged, never raises and never breaks the zero sum or the
attention bounds; messages that cannot be used are counted. Two variants: `paper` (accurate integration, ours)
and `reference` (the authors' implementation, step for step).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from mypy_extensions import mypyc_attr

from opinion_engine import kernels, messages
from opinion_engine.messages import ENCODINGS, Encoding, MessageError, OpinionMessage
from opinion_engine.model import Attention, OpinionError
from opinion_engine.neighbours import Neighbour, Neighbours
from opinion_engine.option_file import OptionSet

ModelVariant = Literal["paper", "reference"]
MODELS: tuple[ModelVariant, ...] = ("paper", "reference")

RESET_SECONDS = 5.0
"""How long after a reset neither updates nor messages count (gcid.md 6)."""

_RATE_WINDOW = 10.0  # seconds over which the bytes sent are averaged


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class EngineSettings:
    """Everything about an engine that is not an option; defaults are those of `pOpinionManager`.

    social_tick in updates per second; stale and max_dt in seconds, max_dt None for 3 / social_tick. Raises
    OpinionError for values out of range.
    """

    group: str = "leader"
    attention: Attention = field(default_factory=Attention)
    opinion_thresh: float = 0.1
    stale: float = 2.0
    social_tick: float = 1.0
    model: ModelVariant = "paper"
    alpha_as_configured: bool = False
    max_dt: float | None = None
    encoding: Encoding = "text"

    def __post_init__(self) -> None:
        for name in ("opinion_thresh", "stale", "social_tick", "max_dt"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0.0):
                raise OpinionError(f"{name} is {value:g}, expected a finite number more than 0")
        if self.model not in MODELS:
            raise OpinionError(f"model '{self.model}' is neither paper nor reference")
        if self.encoding not in ENCODINGS:
            raise OpinionError(f"encoding '{self.encoding}' is none of {', '.join(ENCODINGS)}")
        if not self.group or any(c in self.group for c in ":,"):
            raise OpinionError(f"group '{self.group}' must be one word without ':' and ','")

    @property
    def longest_dt(self) -> float:
        """The longest time one update integrates, in seconds."""
        return 3.0 / self.social_tick if self.max_dt is None else self.max_dt


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Update:
    """The result of one update at `time`: what to publish.

    z, u   opinions by option and attention; inactive options are 0
    choice  index of the dominant option, None while undecided (below the threshold)
    postings  (variable, string) pairs that changed and are to be posted
    text, payload  the own opinion in text form and, with a binary encoding, the bytes to send instead
    """

    time: float
    dt: float
    z: tuple[float, ...]
    u: float
    choice: int | None
    postings: tuple[tuple[str, str], ...]
    text: str
    payload: bytes | None


@dataclass(slots=True)
class Counters:
    """What happened to messages and updates since the start, for the report."""

    updates: int = 0
    accepted: int = 0
    rejected: int = 0
    outdated: int = 0
    own: int = 0
    overflow: int = 0
    capped: int = 0
    bad_inputs: int = 0
    bytes_sent: int = 0
    last_rejection: str = ""


class OpinionEngine:
    """The opinions of one agent called `name` (its community).

    Feed it `take` (inputs and conditions), `receive` (neighbours) and `reset`; call `update` as often as
    convenient: it acts once per 1 / social_tick. `started` is the mission time from which the first update
    integrates.
    """

    def __init__(self, name: str, options: OptionSet, settings: EngineSettings, started: float) -> None:
        if not name or any(c in name for c in ":,"):
            raise OpinionError(f"agent name '{name}' must be one word without ':' and ','")
        self.name = name
        self.options = options
        self.settings = settings
        self.counters = Counters()
        self._reference = settings.model == "reference"
        couplings = (
            options.reference_couplings(settings.alpha_as_configured)
            if self._reference
            else options.couplings()
        )
        n = len(options)
        self._resistance, self._own, self._heard = couplings.resistance, couplings.own, couplings.heard
        attention = settings.attention
        self._attention = (attention.tau_u, attention.u_min, attention.u_max, attention.y_th, attention.n)
        self._names = options.names
        self._z = np.zeros(n)
        self._u = attention.u_min
        self._b = np.zeros(n)
        self._raw: list[float | None] = [None] * n
        self._heard_sum = np.zeros(n)
        self._heard_square = 0.0
        self._strings: dict[str, str | None] = {
            c.variable: None for o in options.options for c in o.conditions
        }
        self._inputs: dict[str, list[int]] = {}
        for j, option in enumerate(options.options):
            self._inputs.setdefault(option.input_variable, []).append(j)
        self._active = np.zeros(n, np.bool_)
        self._flags: tuple[bool, ...] = ()
        self._refresh_activity()
        self._heard_of = Neighbours(self._names, settings.stale, settings.opinion_thresh)
        self._posted: dict[str, str] = {}
        self._lists: dict[str, str] = {}
        self._sent: deque[tuple[float, int]] = deque()
        self._period = 1.0 / settings.social_tick
        self._last = started
        self._reset_until = -np.inf

    # --- what it knows -------------------------------------------------------------------------

    @property
    def z(self) -> tuple[float, ...]:
        """The opinions, by option."""
        return tuple(self._z.tolist())

    @property
    def u(self) -> float:
        """The attention."""
        return self._u

    @property
    def inputs(self) -> tuple[float, ...]:
        """The inputs b, by option."""
        return tuple(self._b.tolist())

    @property
    def raw_inputs(self) -> tuple[float | None, ...]:
        """The raw input values received, None where none came yet."""
        return tuple(self._raw)

    @property
    def active(self) -> tuple[bool, ...]:
        """Which options are active."""
        return self._flags

    @property
    def y(self) -> float:
        """The attention's drive y_i: own mean square plus that of the neighbours heard at the last update."""
        return float(np.dot(self._z, self._z)) / max(1, sum(self._flags)) + self._heard_square

    @property
    def variables(self) -> tuple[str, ...]:
        """The input and condition variables to subscribe to."""
        return tuple(sorted({*self._inputs, *self._strings}))

    @property
    def neighbours(self) -> tuple[Neighbour, ...]:
        """The neighbours on record, stale ones included, by name."""
        return self._heard_of.all()

    # --- what comes in -------------------------------------------------------------------------

    def take(self, variable: str, value: Any) -> None:
        """A new value of an input or condition variable; others are ignored.

        An input takes numbers (or text that is one); a condition compares strings. Raises OpinionError,
        changing nothing, when an input is not a finite number.
        """
        indices = self._inputs.get(variable)
        if indices is not None:
            try:
                raw = float(value)
            except (TypeError, ValueError):
                raw = math.nan
            if not math.isfinite(raw):
                self.counters.bad_inputs += 1
                raise OpinionError(
                    f"input {variable} = {str(value)[:40]!r} is not a finite number; the last one stays"
                )
            for j in indices:
                self._raw[j] = raw
                self._b[j] = self.options.options[j].utility(raw)
        if variable in self._strings:
            self._strings[variable] = value if isinstance(value, str) else None
            self._refresh_activity()

    def _refresh_activity(self) -> None:
        flags = tuple(
            all(c.holds(self._strings[c.variable]) for c in option.conditions)
            for option in self.options.options
        )
        if flags != self._flags:
            self._flags = flags
            self._active[:] = flags
            if self._reference:
                self._z[~self._active] = 0.0
            else:
                kernels.project_active(self._z, self._active)

    def receive(self, message: str | bytes, now: float, sender: str = "", time: float | None = None) -> bool:
        """An opinion message from a neighbour, sent at `time` (default now); True if it was taken.

        It counts as fresh from now on, whatever its way took: clocks of vessels may differ. Text
        names its sender; a binary payload comes from `sender`, the source community of its carrier. Not
        taken, and counted: messages during a reset, damaged ones, one's own, and those older than the record
        held (the last two are taken by the `reference` variant).
        """
        if now < self._reset_until:
            return False
        sent = now if time is None else min(time, now)
        try:
            record = self._parse(message, sender)
        except MessageError as error:
            self.counters.rejected += 1
            self.counters.last_rejection = str(error)
            return False
        if not self._reference:
            if record.vname.lower() == self.name.lower():
                self.counters.own += 1
                return False
            if sent < self._heard_of.sent(record.vname):
                self.counters.outdated += 1
                return False
        text = message if isinstance(message, str) else message.hex()
        if not self._heard_of.store(record, sent, now, text):
            self.counters.overflow += 1
            return False
        self.counters.accepted += 1
        return True

    def _parse(self, message: str | bytes, sender: str) -> OpinionMessage:
        if isinstance(message, str):
            return messages.parse_text(message)
        sender = sender.strip()
        if not sender or len(sender) > 200 or any(c in sender for c in ":,"):
            raise MessageError("binary opinion message from nobody: the carrier names no community")
        z, active = messages.decode_binary(message, len(self._names))
        opinions = {name: z[j] for j, name in enumerate(self._names) if active[j]}
        return OpinionMessage(sender, "", opinions)

    def reset(self, now: float) -> None:
        """Start over: opinions 0, attention u_min, neighbours and last choice forgotten, deaf and still for 5
        s.
        """
        self._z[:] = 0.0
        self._u = self.settings.attention.u_min
        self._heard_square = 0.0
        self._posted.clear()
        self._reset_until = now + RESET_SECONDS
        if not self._reference:  # which keeps the time from which the next step counts
            self._last = self._reset_until - self._period
        self._heard_of.forget()

    # --- what goes out -------------------------------------------------------------------------

    def update(self, now: float) -> Update | None:
        """Advance to `now` and say what to publish; None when it is not time yet, or no option is active."""
        dt = now - self._last
        # A tick of 1 s counted in steps of 0.1 s may fall short by round-off.
        if now < self._reset_until or dt <= 0.0 or dt < self._period - 1e-6:
            return None
        if True not in self._flags:
            if not self._reference:
                self._last = now  # nothing was there to integrate
            return None
        if not self._reference and dt > self.settings.longest_dt:
            self.counters.capped += 1
            dt = self.settings.longest_dt
        heard = self._heard_of
        self._u, self._heard_square = kernels.agent_update(
            self._z,
            self._u,
            dt,
            now,
            self.settings.stale,
            len(heard),
            heard.times,
            heard.z,
            heard.squares,
            self._heard_sum,
            self._resistance,
            self._own,
            self._heard,
            self._b,
            self._active,
            *self._attention,
            self._reference,
        )
        self._last = now
        self.counters.updates += 1
        z = tuple(self._z.tolist())
        choice = self._choice(z)
        text = messages.format_text(self.name, self.settings.group, self._names, z, self._flags)
        payload = None
        if self.settings.encoding != "text":
            payload = messages.encode_binary(z, self.settings.encoding, self._flags)
        self._count_bytes(now, len(text) if payload is None else len(payload))
        return Update(now, dt, z, self._u, choice, self._new_postings(choice), text, payload)

    def _choice(self, z: Sequence[float]) -> int | None:
        """The dominant option: the first within 1e-9 of the largest active opinion, if that reaches the
        threshold.
        """
        best = -np.inf
        for j, value in enumerate(z):
            if self._flags[j] and value > best:
                best = value
        if not best >= self.settings.opinion_thresh:
            return None
        for j, value in enumerate(z):
            if self._flags[j] and value >= best - 1e-9:
                return j
        return None

    def _new_postings(self, choice: int | None) -> tuple[tuple[str, str], ...]:
        if choice is None:
            return ()
        outputs = self.options.options[choice].outputs
        new = tuple(pair for pair in outputs if self._posted.get(pair[0]) != pair[1])
        if new:
            self._posted.update(new)
        return new

    def _count_bytes(self, now: float, size: int) -> None:
        self.counters.bytes_sent += size
        self._sent.append((now, size))
        while self._sent[0][0] <= now - _RATE_WINDOW:
            self._sent.popleft()

    def bytes_per_second(self, now: float) -> float:
        """Payload bytes sent per second, over the last 10 s (or since the first update, if that is less)."""
        recent = [(time, size) for time, size in self._sent if time > now - _RATE_WINDOW]
        if not recent:
            return 0.0
        span = min(_RATE_WINDOW, max(now - recent[0][0] + self._period, self._period))
        return sum(size for _, size in recent) / span

    def population(self, now: float) -> dict[str, tuple[str, ...]]:
        """Fresh neighbours by dominant option: option name, or '' for the undecided, to sorted names."""
        return self._heard_of.by_choice(now)

    def list_changes(self, now: float) -> tuple[tuple[str, str], ...]:
        """`<OPTION>_LIST` and `UNDECIDED_LIST` postings that differ from the last call's (gcid.md 7)."""
        changed = []
        for option, names in self.population(now).items():
            variable = f"{option.upper() or 'UNDECIDED'}_LIST"
            text = ",".join(names)
            if self._lists.get(variable, "") != text:
                self._lists[variable] = text
                changed.append((variable, text))
        return tuple(changed)
