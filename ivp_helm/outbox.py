"""What leaves the helm: posts in order, and the memory that drops repetitions (helm.md 5.5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ivp_helm.behavior import Post
from ivp_helm.info_buffer import InfoBuffer
from pymoos_lite.core.message import Value

MAP_CLEAR_PERIOD = 2.0
"""Least mission seconds between two forgettings of what was sent."""


class HelmPost:
    """A value to publish; `aux` says which iteration and behaviour it came from."""

    __slots__ = ("aux", "value", "variable")  # no tuple, for the reason that `Post` is none

    def __init__(self, variable: str, value: Value, aux: str = "") -> None:
        self.variable = variable
        self.value = value
        self.aux = aux


class LastPost(NamedTuple):
    """The newest post of a variable by a behaviour, for the report."""

    variable: str
    behavior: str
    time: float
    iteration: int
    value: Value


class Outbox:
    """Collects posts; a behaviour's post is dropped if it repeats the last one sent under the same key."""

    def __init__(self) -> None:
        self.posts: list[HelmPost] = []
        self._latest: dict[tuple[str, str], tuple[float, int, Value]] = {}
        """By behaviour and variable: time, iteration and value of the newest post."""
        self._sent: dict[str, dict[tuple[str, str], Value]] = {}
        """By behaviour: what was sent last, by variable and key."""
        self._changed: dict[str, Value] = {}
        self._cleared = float("-inf")

    def post(self, variable: str, value: Value, aux: str = "") -> None:
        """Publish, always."""
        self.posts.append(HelmPost(variable, value, aux))

    def post_change(self, variable: str, value: Value, aux: str = "") -> None:
        """Publish if it differs from what was last published this way."""
        if self._changed.get(variable) != value:
            self._changed[variable] = value
            self.posts.append(HelmPost(variable, value, aux))

    def drain(self, posts: Sequence[Post], behavior: str, buffer: InfoBuffer, iteration: int) -> None:
        """A behaviour's posts: into the buffer all of them, out of the helm those that say something new."""
        sent = self._sent.get(behavior)
        if sent is None:
            sent = self._sent[behavior] = {}
        now = buffer.now
        aux = ""
        for post in posts:
            variable, value, key = post.variable, post.value, post.key
            buffer.assign(variable, value)
            if key is not None:
                memory = (variable, key)
                former = sent.get(memory)
                if former == value and type(former) is type(value):
                    continue
                sent[memory] = value
            aux = aux or f"{iteration}:{behavior}"
            self.posts.append(HelmPost(variable, value, aux))
            self._latest[behavior, variable] = (now, iteration, value)

    def newest(self) -> list[LastPost]:
        """The newest post of each variable by each behaviour."""
        return [LastPost(variable, behavior, *post) for (behavior, variable), post in self._latest.items()]

    def forget_behavior(self, behavior: str) -> None:
        """A behaviour is gone; one of the same name starts afresh."""
        self._sent.pop(behavior, None)
        self._latest = {memory: post for memory, post in self._latest.items() if memory[0] != behavior}

    def forget_all(self, now: float) -> bool:
        """Send everything again from now on (a viewer asked); False if that was done a moment ago."""
        if now - self._cleared < MAP_CLEAR_PERIOD:
            return False
        self._cleared = now
        self._sent.clear()
        return True

    def forget_everything(self) -> None:
        """Send everything again from now on, the helm's own values included."""
        self._sent.clear()
        self._changed.clear()

    def forget_change(self, variable: str) -> None:
        """Let the next `post_change` of the variable go out."""
        self._changed.pop(variable, None)

    def take(self) -> list[HelmPost]:
        """All posts since the last call."""
        posts = self.posts
        self.posts = []
        return posts
