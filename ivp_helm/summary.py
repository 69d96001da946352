"""IVPHELM_SUMMARY and the lists of behaviours: what tools read about a helm's state (helm.md 10.1, 10.2).

The first summary is complete; later ones carry `iter`, `utc_time` and whatever changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from ivp_helm.lifecycle import Life, Outcome
from pymoos_lite.geometry.text import num, split_protected


class Timing(NamedTuple):
    """Seconds spent building and solving, this iteration and at most."""

    create: float = 0.0
    solve: float = 0.0
    max_create: float = 0.0
    max_solve: float = 0.0
    max_loop: float = 0.0

    def after(self, create: float, solve: float) -> Timing:
        if (create, solve) == self[:2] and create + solve <= self.max_loop:
            return self  # in lockstep, where clocks stand still, for ever
        return Timing(
            create,
            solve,
            max(create, self.max_create),
            max(solve, self.max_solve),
            max(create + solve, self.max_loop),
        )


class Figures(NamedTuple):
    """What one iteration came to, as far as the summary tells it."""

    iteration: int
    now: float
    functions: int
    pieces: int
    pieces_reused: int
    warnings: int
    timing: Timing
    decision: Mapping[str, float]
    halted: bool
    active_goal: bool
    modes: str
    halt_message: str


def _seconds(value: float) -> str:
    return f"{value:.2f}"


def _truth(value: object) -> str:
    return "true" if value else "false"


# The keys in their order, and how each is written; what has not changed is not even formatted.
_WRITERS: tuple[tuple[str, Callable[..., str]], ...] = (
    ("ofnum", str),
    ("total_pcs_formed", str),
    ("total_pcs_cached", str),
    ("warnings", str),
    ("solve_time", _seconds),
    ("create_time", _seconds),
    ("max_create_time", _seconds),
    ("max_solve_time", _seconds),
    ("max_loop_time", _seconds),
    ("loop_time", _seconds),
    ("var", str),
    ("halted", _truth),
    ("active_goal", _truth),
    ("modes", str),
)


class Summary:
    """Makes the texts of IVPHELM_SUMMARY, each relative to the one before."""

    def __init__(self, variables: Sequence[str], domain_text: str) -> None:
        self._variables = tuple(variables)
        self._domain = f'ivpdomain="{domain_text}"'
        self._told: dict[str, str] = {}
        self._groups: dict[str, tuple[object, ...]] = {}
        self._raw: tuple[object, ...] | None = None

    def restart(self) -> None:
        """Make the next one complete."""
        self._told.clear()
        self._groups.clear()
        self._raw = None

    def text(
        self,
        figures: Figures,
        rounds: Sequence[tuple[Life, Outcome]],
        completed: Sequence[tuple[str, float]],
    ) -> str:
        """The next value of IVPHELM_SUMMARY."""
        told = self._told
        parts = [f"iter={figures.iteration},utc_time={figures.now:.2f}"]
        timing = figures.timing
        decision = figures.decision
        raw = (
            figures.functions,
            figures.pieces,
            figures.pieces_reused,
            figures.warnings,
            timing.solve,
            timing.create,
            timing.max_create,
            timing.max_solve,
            timing.max_loop,
            timing.create + timing.solve,
            tuple([decision.get(name) for name in self._variables]),
            figures.halted,
            figures.active_goal,
            figures.modes,
        )
        former = self._raw
        if raw != former:
            self._raw = raw
            for k, (key, write) in enumerate(_WRITERS):
                if former is not None and raw[k] == former[k]:
                    continue
                text = self._decision(decision) if key == "var" else f"{key}={write(raw[k])}"
                if told.get(key) != text:
                    told[key] = text
                    parts.append(text)
        self._behaviors(parts, rounds, completed)
        if "ivpdomain" not in told:
            told["ivpdomain"] = self._domain
            parts.append(self._domain)
        if told.get("halt_msg") != figures.halt_message:
            told["halt_msg"] = figures.halt_message
            parts.append(f"halt_msg={figures.halt_message}")
        return ",".join(parts)

    def _decision(self, decision: Mapping[str, float]) -> str:
        shown = [
            f"var={name}:{num(decision[name], 5) if name in decision else 'varbalk'}"
            for name in self._variables
        ]
        return ",".join(shown)

    def _behaviors(
        self,
        parts: list[str],
        rounds: Sequence[tuple[Life, Outcome]],
        completed: Sequence[tuple[str, float]],
    ) -> None:
        running: list[tuple[object, ...]] = []
        active: list[tuple[object, ...]] = []
        disabled: list[tuple[object, ...]] = []
        idle: list[tuple[object, ...]] = []
        groups = {"running": running, "active": active, "disabled": disabled, "idle": idle}
        for life, outcome in rounds:
            state = outcome.state
            if state == "active":
                function = outcome.function
                assert function is not None
                groups[state].append(
                    (
                        life.name,
                        life.entered,
                        function.weight,
                        function.pieces,
                        outcome.build_seconds,
                        life.counts,
                        *life.behavior.mode(),
                    )
                )
            elif state in groups:
                groups[state].append((life.name, life.entered, life.counts))
        for state, rows in groups.items():
            key = tuple(rows)
            if self._groups.get(state) != key:
                self._groups[state] = key
                shown = ":".join(_active(row) if state == "active" else _plain(row) for row in rows) or "none"
                parts.append(f"{state}_bhvs={shown}")
        key = tuple(completed)
        if self._groups.get("completed") != key:
            self._groups["completed"] = key
            shown = ":".join(f"{name}${when:.2f}$n/a" for name, when in completed) or "none"
            parts.append(f"completed_bhvs={shown}")


def _active(row: tuple[object, ...]) -> str:
    name, entered, weight, pieces, seconds, counts, mode, submode = row
    return f"{name}${entered:.2f}${weight:.5f}${pieces}${seconds:.5f}${counts}$1${mode}${submode}"


def _plain(row: tuple[object, ...]) -> str:
    name, entered, counts = row
    return f"{name}${entered:.2f}${counts}"


class SummaryReader:
    """The other end: a full picture kept up to date from differential summaries.

    `values` holds the latest text of every key; `decision` the variables decided in the last iteration.
    """

    def __init__(self) -> None:
        self.values: dict[str, str] = {}
        self.decision: dict[str, float] = {}

    def take(self, text: str) -> None:
        """Note one IVPHELM_SUMMARY; anything malformed is skipped."""
        fresh = True
        for piece in split_protected(text, ","):
            key, equals, value = piece.partition("=")
            if not equals:
                continue
            if key == "var":
                if fresh:
                    self.decision.clear()
                    fresh = False
                name, _, number = value.partition(":")
                if number != "varbalk":
                    try:
                        self.decision[name] = float(number)
                    except ValueError:
                        continue
            else:
                self.values[key] = value.strip('"')

    def names(self, state: str) -> list[str]:
        """Names of the behaviours in a state: active, running, idle, disabled or completed."""
        text = self.values.get(f"{state}_bhvs", "none")
        return [] if text in ("none", "") else [entry.split("$")[0] for entry in text.split(":")]

    def modes(self) -> dict[str, str]:
        """Mode variables and their values."""
        text = self.values.get("modes", "none")
        pairs = (entry.partition("@") for entry in text.split("#") if "@" in entry)
        return {name: value for name, _, value in pairs}


def state_variables(lives: Iterable[Life]) -> set[str]:
    """Variables in conditions and state flags, for IVPHELM_STATEVARS."""
    found: set[str] = set()
    for life in lives:
        config = life.behavior.config
        for condition in config.condition:
            found.update(condition.variables())
        for key in ("runflag", "runxflag", "idleflag", "endflag", "activeflag", "inactiveflag"):
            found.update(flag.variable for flag in getattr(config, key))
    return found
