"""The behaviours of a helm: those of the file, those spawned from templates, and those that died
(helm.md 7.2 to 7.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ivp_helm.behavior_file import BehaviorBlock
from ivp_helm.build import Built, Finder, Template, build_all, build_behavior
from ivp_helm.lifecycle import Life, Origin
from ivp_helm.surroundings import Surroundings
from ivp_helm.updates import parse_update, update_name
from pymoos_lite.config.mission import ConfigLine

MAX_REMEMBERED = 20
MAX_WAITING = 100


class Population:
    """`lives` run in this order: file order, then order of spawning."""

    def __init__(
        self,
        blocks: Sequence[BehaviorBlock],
        find: Finder,
        surroundings: Surroundings,
        stopwatch: Callable[[], float] = float,
        accept_retired: bool = False,
    ) -> None:
        self.surroundings = surroundings
        self.built: Built = build_all(blocks, find, surroundings, accept_retired)
        self._accept_retired = accept_retired
        self.templates = self.built.templates
        self.request_variables = frozenset(template.updates for template in self.templates)
        self._stopwatch = stopwatch
        self.lives = [
            Life(behavior, Origin(block.kind), stopwatch) for behavior, block in self.built.behaviors
        ]
        self.ever = len(self.lives)
        self.completed: list[tuple[str, float]] = []
        """Names of the dead with the time of their death, newest last."""
        self.completed_count = 0
        self.life_events: list[str] = []
        """Values of IVPHELM_LIFE_EVENT since the helm last took them."""
        self.warnings: list[str] = []
        self.disabled_contacts: dict[str, None] = {}

    def __iter__(self) -> Iterator[Life]:
        return iter(self.lives)

    def names(self) -> set[str]:
        return {life.name for life in self.lives}

    def announce_birth(self, started: float) -> None:
        """Life events for the behaviours of the file."""
        for life in self.lives:
            self._event(life.name, life.origin, "spawn", 0.0, 0)

    def spawn(self, now: float, started: float, iteration: int) -> list[Life]:
        """Answer the spawn requests of this round."""
        newcomers = []
        for template in self.templates:
            if not template.updates:
                continue
            for text in self.surroundings.buffer.delta_texts(template.updates):
                life = self._request(template, text, now - started, iteration) if "name" in text else None
                if life is not None:
                    newcomers.append(life)
        return newcomers

    def _request(self, template: Template, text: str, age: float, iteration: int) -> Life | None:
        wanted = update_name(text)
        if not wanted:
            return None
        prefix = template.prefix
        full = wanted if wanted.startswith(prefix) else prefix + wanted
        taken = self.names()
        if full in taken or wanted in taken:
            return None
        if template.limit > 0 and template.made >= template.limit:
            return None
        template.tried += 1
        lines = [
            ConfigLine(key, value, template.block.line) for key, value in parse_update(text) if key != "name"
        ]
        behavior, problems = build_behavior(
            template.cls, template.block, self.surroundings, full, lines, self._accept_retired
        )
        origin = Origin(template.block.kind, prefix, text)
        if behavior is None:
            reason = problems[0].text if problems else "unknown"
            self.warnings.append(f"Failed to spawn {full}. Bad config: {reason}")
            self._event("", origin, "abort", age, iteration)
            self.warnings.append(f"Behavior named [{wanted}] or [{full}] not found or spawned.")
            return None
        template.made += 1
        behavior.spawned = True
        life = Life(behavior, origin, self._stopwatch)
        if str(vars(behavior.config).get("contact", "")).lower() in self.disabled_contacts:
            life.disabled = True
        life.begin()
        self.lives.append(life)
        self.ever += 1
        self._event(full, origin, "spawn", age, iteration)
        return life

    def bury(self, now: float, started: float, iteration: int) -> list[Life]:
        """Remove the completed ones and return them; their names are free again."""
        dead = [life for life in self.lives if life.behavior.completed]
        if dead:
            self.lives = [life for life in self.lives if not life.behavior.completed]
            for life in dead:
                self.completed.append((life.name, now))
                self._event(
                    life.name, life.origin, "death", now - started, iteration, life.behavior.post_mortem
                )
            self.completed_count += len(dead)
            del self.completed[:-MAX_REMEMBERED]
        return dead

    def disable_contact(self, contact: str) -> None:
        """Remember a contact whose behaviours are disabled, for later spawnings."""
        self.disabled_contacts.pop(contact, None)
        self.disabled_contacts[contact] = None
        while len(self.disabled_contacts) > 200:
            del self.disabled_contacts[next(iter(self.disabled_contacts))]

    def _event(
        self, name: str, origin: Origin, event: str, age: float, iteration: int, mortem: str = ""
    ) -> None:
        parts = [f"iter={iteration}"]
        if age > 0.0:
            parts.append(f"time={age:.2f}")
        parts += [f"bname={name}", f"btype={origin.kind}", f"event={event}"]
        if event != "death":
            parts.append(f"seed={origin.seed}")
        if mortem:
            parts.append(f"post_mortem={mortem}")
        if len(self.life_events) < MAX_WAITING:
            self.life_events.append(",".join(parts))
