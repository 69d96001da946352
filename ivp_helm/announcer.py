"""What a helm publishes about itself in each iteration, in the order that tools expect (helm.md 9.3, 10.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ivp_helm.lifecycle import Life, Outcome
from ivp_helm.summary import Figures, Summary, state_variables

if TYPE_CHECKING:
    from ivp_helm.helm import HelmCore

STATES = ("active", "running", "idle", "disabled")
Rounds = Sequence[tuple[Life, Outcome]]


class Count(NamedTuple):
    """What a round of behaviours came to, added up: functions, pieces built for them and carried over,
    whether one that is no mere constraint has a say, results of updates, seconds spent building."""

    functions: int
    pieces: int
    reused: int
    goal: bool
    updates: int
    build_seconds: float

    @classmethod
    def of(cls, rounds: Rounds) -> Count:
        functions = pieces = reused = updates = 0
        goal = False
        seconds = 0.0
        for life, outcome in rounds:
            updates += len(life.results)
            seconds += outcome.build_seconds
            function = outcome.function
            if function is not None:
                functions += 1
                if outcome.reused:
                    reused += function.pieces
                else:
                    pieces += function.pieces
                if not life.behavior.CONSTRAINT:
                    goal = True
        return cls(functions, pieces, reused, goal, updates, seconds)


class Announcer:
    """Keeps what was told, so that lists and summaries are told when they change."""

    def __init__(self, core: HelmCore) -> None:
        self._core = core
        self._outbox = core.outbox
        self._summary = Summary(core.domain.names, str(core.domain))
        self._lists: dict[str, str] = dict.fromkeys(STATES, "")
        self._listed: list[tuple[str, str]] = []
        self._variables: set[str] = set()
        self._variables_text = ""
        self._updates_text = ""

    def refresh(self) -> None:
        """Make the next summary a complete one, and tell the lists again."""
        self._summary.restart()
        self._lists = dict.fromkeys(STATES, "")
        self._listed = []

    def introduce(self) -> None:
        """The empty counts with which a helm starts."""
        for group in STATES:
            self._outbox.post_change(f"IVPHELM_BHV_{group.upper()}_CNT", 0.0)

    def note_variables(self, lives: Sequence[Life], changed: Sequence[Life] = ()) -> None:
        """Remember the variables that the states of new and changed behaviours turn on, and where updates go."""
        variables = state_variables(changed)
        if not variables <= self._variables:
            self._variables |= variables
            self._variables_text = ",".join(sorted(self._variables))
        named = [(life.name, life.behavior.config.updates) for life in lives]
        self._updates_text = ",".join(f"{name}={variable}" for name, variable in named if variable)

    def before_posts(self, rounds: Rounds, count: Count) -> None:
        """Results of updates, warnings about behaviours, and counts."""
        core, post = self._core, self._outbox.post
        if count.updates:
            for life, _ in rounds:
                for result in life.results:
                    post("IVPHELM_UPDATE_RESULT", result.report(core.buffer.now - core.started))
                life.results.clear()
        for k, warning in enumerate(core.population.warnings):
            post("IVPHELM_BHVSET_WARNING", f"{k}:{warning}")
            core.note("warning", warning)
        core.population.warnings.clear()
        post("IVPHELM_TOTAL_PCS_FORMED", float(count.pieces))
        post("IVPHELM_TOTAL_PCS_CACHED", float(count.reused))
        post("IVPHELM_IPF_CNT", float(count.functions))
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

    def after_posts(
        self, rounds: Rounds, count: Count, decision: Mapping[str, float], complaint: str
    ) -> None:
        """The summary, the lists of behaviours and the times."""
        core, outbox = self._core, self._outbox
        figures = Figures(
            core.iteration,
            core.buffer.now,
            count.functions,
            count.pieces,
            count.reused,
            core.warning_count,
            core.timing,
            decision,
            bool(complaint),
            count.goal,
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
        listed = [(outcome.state, life.behavior.name) for life, outcome in rounds]
        if listed != self._listed:
            self._listed = listed
            for group in STATES:
                names = [name for state, name in listed if state == group]
                text = ",".join(names)
                if text != self._lists[group]:
                    self._lists[group] = text
                    outbox.post(f"IVPHELM_BHV_{group.upper()}", text)
                    outbox.post_change(f"IVPHELM_BHV_{group.upper()}_CNT", float(len(names)))
        outbox.post_change("IVPHELM_BHV_CNT", float(len(self._core.population.lives)))
        outbox.post_change("IVPHELM_BHV_CNT_EVER", float(self._core.population.ever))
