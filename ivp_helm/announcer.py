"""What a helm publishes about itself in each iteration, in the order that tools expect (helm.md 9.3, 10.1)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from ivp_helm.lifecycle import Life, Outcome
from ivp_helm.summary import Figures, Summary, state_variables

if TYPE_CHECKING:
    from ivp_helm.helm import HelmCore

STATES = ("active", "running", "idle", "disabled")
Rounds = Sequence[tuple[Life, Outcome]]


class Announcer:
    """Keeps what was told, so that lists and summaries are told when they change."""

    def __init__(self, core: HelmCore) -> None:
        self._core = core
        self._outbox = core.outbox
        self._summary = Summary(core.domain.names, str(core.domain))
        self._lists: dict[str, str] = dict.fromkeys(STATES, "")
        self._variables: set[str] = set()
        self._variables_text = ""
        self._updates_text = ""

    def refresh(self) -> None:
        """Make the next summary a complete one, and tell the lists again."""
        self._summary.restart()
        self._lists = dict.fromkeys(STATES, "")

    def introduce(self) -> None:
        """The empty counts with which a helm starts."""
        for group in STATES:
            self._outbox.post_change(f"IVPHELM_BHV_{group.upper()}_CNT", 0.0)

    def note_variables(self, lives: Iterable[Life]) -> None:
        """Behaviours were added: remember the variables that their states turn on, and where updates go."""
        lives = list(lives)
        self._variables |= state_variables(lives)
        self._variables_text = ",".join(sorted(self._variables))
        named = [(life.name, life.behavior.config.updates) for life in lives]
        self._updates_text = ",".join(f"{name}={variable}" for name, variable in named if variable)

    def before_posts(self, rounds: Rounds) -> None:
        """Results of updates, warnings about behaviours, and counts."""
        core, post = self._core, self._outbox.post
        for life, _ in rounds:
            for result in life.results:
                post("IVPHELM_UPDATE_RESULT", result.report(core.buffer.now - core.started))
            life.results.clear()
        for k, warning in enumerate(core.population.warnings):
            post("IVPHELM_BHVSET_WARNING", f"{k}:{warning}")
            core.note("warning", warning)
        core.population.warnings.clear()
        functions, pieces, reused = _count(rounds)
        post("IVPHELM_TOTAL_PCS_FORMED", float(pieces))
        post("IVPHELM_TOTAL_PCS_CACHED", float(reused))
        post("IVPHELM_IPF_CNT", float(functions))
        post("IVPHELM_ITER", float(core.iteration))

    def deaths(self, count: int) -> None:
        """Behaviours ended in this iteration; and the life events that wait to be told."""
        outbox, population = self._outbox, self._core.population
        if self._variables_text:
            outbox.post_change("IVPHELM_STATEVARS", self._variables_text)
        outbox.post_change("IVPHELM_COMPLETED_PENDING", "true" if count else "false")
        outbox.post_change("IVPHELM_COMPLETED_COUNT", float(count))
        if population.life_events:
            for event in population.life_events:
                outbox.post("IVPHELM_LIFE_EVENT", event)
            population.life_events.clear()
        if count:
            self.note_variables(population.lives)

    def after_posts(self, rounds: Rounds, decision: Mapping[str, float], complaint: str) -> None:
        """The summary, the lists of behaviours and the times."""
        core, outbox = self._core, self._outbox
        functions, pieces, reused = _count(rounds)
        figures = Figures(
            core.iteration,
            core.buffer.now,
            functions,
            pieces,
            reused,
            core.warning_count,
            core.timing,
            decision,
            bool(complaint),
            has_goal(rounds),
            core.modes.summary(),
            complaint or "none",
        )
        outbox.post("IVPHELM_SUMMARY", self._summary.text(figures, rounds, core.population.completed))
        self._tell_lists(rounds)
        outbox.post("IVPHELM_CREATE_CPU", core.timing.create)
        outbox.post("IVPHELM_LOOP_CPU", core.timing.create + core.timing.solve)
        if self._updates_text:
            outbox.post_change("IVPHELM_UPDATEVARS", self._updates_text)

    def _tell_lists(self, rounds: Rounds) -> None:
        outbox = self._outbox
        groups: dict[str, list[str]] = {group: [] for group in STATES}
        for life, outcome in rounds:
            if outcome.state in groups:
                groups[outcome.state].append(life.name)
        for group, names in groups.items():
            text = ",".join(names)
            if text != self._lists[group]:
                self._lists[group] = text
                outbox.post(f"IVPHELM_BHV_{group.upper()}", text)
                outbox.post_change(f"IVPHELM_BHV_{group.upper()}_CNT", float(len(names)))
        outbox.post_change("IVPHELM_BHV_CNT", float(len(self._core.population.lives)))
        outbox.post_change("IVPHELM_BHV_CNT_EVER", float(self._core.population.ever))


def has_goal(rounds: Rounds) -> bool:
    """Whether a behaviour that is no mere constraint has a say."""
    return any(o.function is not None and not life.behavior.CONSTRAINT for life, o in rounds)


def _count(rounds: Rounds) -> tuple[int, int, int]:
    """Functions, pieces built for them, pieces carried over."""
    functions = pieces = reused = 0
    for _, outcome in rounds:
        if outcome.function is not None:
            functions += 1
            if outcome.reused:
                reused += outcome.function.pieces
            else:
                pieces += outcome.function.pieces
    return functions, pieces, reused
