"""Why the helm decided what it decided: for any iteration, from a helm in memory, a log, or a live community.

    explanation = explain(core)                       # a helm core, after an iteration
    for explanation in explanations(entries): ...     # (time, variable, value) of a log, in order
    print("\\n".join(explanation.lines()))

It tells which behaviours ran and why the others did not, each one's weight and own best point, the decision,
and what each gave up for it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from ivp_helm.ivp import IvPError, IvPFunction, solve
from ivp_helm.ivp.codec import decode
from ivp_helm.ivp.packets import Joiner
from ivp_helm.summary import SummaryReader
from pymoos_lite.geometry.text import num

if TYPE_CHECKING:
    from ivp_helm.helm import HelmCore

VARIABLES = (
    "IVPHELM_STATE",
    "IVPHELM_ALLSTOP",
    "IVPHELM_ITER",
    "IVPHELM_SUMMARY",
    "BHV_IPF",
    "BHV_STATUS",
    "BHV_WHY",
    "BHV_ERROR",
)
"""What an explanation is made from."""

_STATUS = re.compile(r"(name|pc|pwt|pcs|state|updates)=(.*?)(?=,(?:pc|pwt|pcs|state|updates)=|\Z)")


@dataclass(frozen=True)
class Part:
    """One behaviour's part in an iteration. `reason` is the first false condition, or what it says of itself."""

    name: str
    state: str
    reason: str = ""
    function: IvPFunction | None = None

    @property
    def weight(self) -> float:
        return self.function.weight if self.function is not None else 0.0

    def best(self) -> dict[str, float]:
        """Its own best point; empty without a function."""
        if self.function is None:
            return {}
        return solve(self.function.domain, [self.function.weighted(1.0)]).as_dict()

    def utility(self, decision: Mapping[str, float]) -> float | None:
        """What the decision is worth to it, on its own scale; None if it has no say in it."""
        function = self.function
        if function is None or not all(name in decision for name in function.domain.names):
            return None
        return function.value(*(decision[name] for name in function.domain.names))


@dataclass(frozen=True)
class Explanation:
    """An iteration, ready to be told. `halted` is the error that stopped the vehicle, if one did."""

    iteration: int
    time: float
    state: str
    reason: str
    modes: Mapping[str, str]
    decision: Mapping[str, float]
    parts: tuple[Part, ...]
    halted: str = ""

    @property
    def functions(self) -> list[tuple[str, IvPFunction]]:
        return [(part.name, part.function) for part in self.parts if part.function is not None]

    def part(self, name: str) -> Part:
        """The part of a behaviour.

        Raises:
            KeyError: it took no part.
        """
        for part in self.parts:
            if part.name == name:
                return part
        raise KeyError(name)

    def lines(self) -> Iterator[str]:
        """The explanation in plain words."""
        yield f"Iteration {self.iteration} at {self.time:.2f} s, helm in {self.state or 'unknown state'}"
        if self.modes:
            yield "Modes: " + ", ".join(f"{name} = {value}" for name, value in sorted(self.modes.items()))
        yield self._verdict()
        voters = [part for part in self.parts if part.function is not None]
        total = sum(part.weight for part in voters)
        if voters:
            yield ""
            yield "Who had a say:"
            width = max(len(part.name) for part in voters)
            for part in voters:
                yield f"  {part.name:<{width}}  {self._vote(part, total)}"
                if part.reason:
                    yield f"  {'':<{width}}  {part.reason}"
        silent = [part for part in self.parts if part.function is None]
        if silent:
            yield ""
            yield "Who had none:"
            width = max(len(part.name) for part in silent)
            for part in silent:
                yield f"  {part.name:<{width}}  {part.state}: {self._silence(part)}"

    def _verdict(self) -> str:
        if self.reason and self.reason != "clear":
            return f"All-stop, because {plain_reason(self.reason)}" + (
                f" ({self.halted})" if self.halted else ""
            )
        if not self.decision:
            return "No decision."
        return f"Decision: {point_text(self.decision)}"

    def _vote(self, part: Part, total: float) -> str:
        assert part.function is not None
        best = part.best()
        best_utility = part.utility(best)
        text = f"weight {num(part.weight, 2)} of {num(total, 2)}, wants {point_text(best)}"
        utility = part.utility(self.decision)
        if utility is None or best_utility is None:
            return text
        given_up = best_utility - utility
        spread = best_utility - part.function.minimum
        share = 100.0 * given_up / spread if spread > 0.0 else 0.0
        if given_up <= 0.005:
            return f"{text}, and gets it (utility {num(utility, 1)})"
        return f"{text} (utility {num(best_utility, 1)}), gets {num(utility, 1)}: gives up {num(share, 0)} %"

    @staticmethod
    def _silence(part: Part) -> str:
        if part.state == "idle":
            return f"not true: {part.reason}" if part.reason else "its conditions do not hold"
        if part.state == "running":
            return part.reason or "it has no opinion"
        return part.reason or part.state


def point_text(point: Mapping[str, float]) -> str:
    """``course 90, speed 2``."""
    return ", ".join(f"{name} {num(value, 3)}" for name, value in point.items()) or "nothing"


def plain_reason(reason: str) -> str:
    """An all-stop reason in words."""
    word, _, names = reason.partition(":")
    words = {
        "ManualOverride": "a person has control (manual override)",
        "BehaviorError": "a behaviour reported an error",
        "NothingToDo": "no behaviour wants anything",
        "NoGoalBehavior": "only limits have a say, and no goal",
        "MissingDecVars": f"no behaviour decides {names.replace(',', ' or ')}",
        "DisabledByStandbyHelm": "another helm has taken over",
        "StaleNav": "own position is too old",
    }
    return words.get(word, reason)


def explain(core: HelmCore) -> Explanation | None:
    """The last iteration of a helm in memory; None before the first one."""
    trace = core.trace
    if trace is None:
        return None
    parts = []
    for life, outcome in trace.rounds:
        reason = outcome.blocked
        if not reason and outcome.state in ("active", "running", "completed"):
            reason = life.behavior.why
        parts.append(Part(life.name, outcome.state, reason, outcome.function))
    errors = [life.behavior.last_error for life, outcome in trace.rounds if outcome.failed]
    return Explanation(
        trace.iteration,
        trace.now,
        core.authority.state,
        trace.reason,
        dict(core.modes.assigned),
        trace.decision,
        tuple(parts),
        errors[0] if errors else "",
    )


# --- from posts -------------------------------------------------------------------------------------------


class Entry(NamedTuple):
    """A post, as logs and mail have it."""

    time: float
    variable: str
    value: str


@dataclass
class History:
    """Follows a helm's posts; `current` is the picture of the iteration being told."""

    summary: SummaryReader = field(default_factory=SummaryReader)
    iteration: int = 0
    time: float = 0.0
    state: str = ""
    reason: str = ""
    error: str = ""
    told: bool = False
    """A summary of the iteration has come."""
    _texts: dict[str, str] = field(default_factory=dict)
    _why: dict[str, str] = field(default_factory=dict)
    _blocked: dict[str, str] = field(default_factory=dict)
    _joiner: Joiner = field(default_factory=Joiner)

    def take(self, entry: Entry) -> Explanation | None:
        """Note a post; returns the explanation of the iteration before when a new one begins."""
        finished = None
        name, value = entry.variable, entry.value
        if name == "IVPHELM_ITER":
            finished = self.explanation() if self.told else None
            self._begin(entry)
        elif name == "IVPHELM_SUMMARY":
            self.summary.take(value)
            self.told = True
            self.time = entry.time
            self.iteration = _whole(self.summary.values.get("iter", ""), self.iteration)
        elif name == "BHV_IPF":
            self._packet(entry)
        elif name == "BHV_STATUS":
            self._status(value)
        elif name == "BHV_WHY":
            who, _, why = value.removeprefix("name=").partition(",why=")
            self._why[who] = why
        elif name == "IVPHELM_ALLSTOP":
            self.reason = value
        elif name == "IVPHELM_STATE":
            self.state = value
        elif name == "BHV_ERROR":
            self.error = value
        return finished

    def explanation(self) -> Explanation:
        """What is known of the present iteration."""
        parts = []
        for state in ("active", "running", "completed", "disabled", "idle"):
            for name in self.summary.names(state):
                if state == "completed" and name not in self._texts:
                    continue  # the summary keeps naming those that died long ago
                reason = self._why.get(name, "") or self._blocked.get(name, "")
                parts.append(Part(name, state, reason, self._function(name)))
        return Explanation(
            self.iteration,
            self.time,
            self.state,
            self.reason,
            self.summary.modes(),
            dict(self.summary.decision),
            tuple(parts),
            self.error if self.reason.startswith("BehaviorError") else "",
        )

    def _begin(self, entry: Entry) -> None:
        self.told = False
        self.error = ""
        self._texts = {}
        self.time = entry.time
        self.iteration = _whole(entry.value, self.iteration)

    def _packet(self, entry: Entry) -> None:
        try:
            joined = self._joiner.add(entry.value, entry.time)
        except IvPError:
            return
        if joined is not None:
            name, _, _ = joined.id.rpartition("^")
            self._texts[name] = joined.text

    def _function(self, name: str) -> IvPFunction | None:
        text = self._texts.get(name)
        if text is None:
            return None
        try:
            return decode(text)
        except IvPError:
            return None

    def _status(self, text: str) -> None:
        fields = dict(reversed(_STATUS.findall(text)))  # of several reasons the first counts
        name = fields.get("name")
        if name:
            self._blocked[name] = fields.get("pc", "")


def explanations(entries: Iterable[Entry]) -> Iterator[Explanation]:
    """One explanation per iteration of a helm whose posts come in order."""
    history = History()
    for entry in entries:
        finished = history.take(entry)
        if finished is not None:
            yield finished
    if history.told:
        yield history.explanation()


def _whole(text: str, otherwise: int) -> int:
    try:
        return int(float(text))
    except (ValueError, OverflowError):
        return otherwise
