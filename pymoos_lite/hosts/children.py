"""Processes that a host starts, listens to and ends.

Each is a module run with this Python, told what to do by one line of JSON on its stdin; the end of its
stdin tells it to end. What it prints is passed on; a line that begins with READY says where it listens.
"""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from pymoos_lite.core.clock import Clock

READY = "listening on port "
"""What a process that has a database says when clients may come."""

GOODBYE = 3.0
"""Wall seconds without a sign of progress after which a process that was asked to end is ended."""

LONGEST_GOODBYE = 60.0
"""Wall seconds after which it is ended in any case."""

ENDING = "still ending"
"""What a process says again and again while it is ending and its work goes on: no news for a person."""


class NotReadyError(Exception):
    """A process ended, or said nothing in time, instead of becoming ready; the text is what it said."""


_LOOK_AGAIN = 0.02


@dataclass
class _Child:
    name: str
    process: subprocess.Popen[str]
    listener: threading.Thread


@dataclass(frozen=True)
class Exit:
    """How a process ended."""

    name: str
    pid: int
    status: int

    def __str__(self) -> str:
        if self.status < 0:
            return f"was ended by signal {-self.status}"
        return f"ended with status {self.status}"


class Children:
    """The processes of one host; see the module. `tell` hears what they print.

    `goodbye` is how long (wall seconds) they may show no progress once they were asked to end.
    """

    def __init__(self, clock: Clock, tell: Callable[[str], None], goodbye: float = GOODBYE) -> None:
        self._clock = clock
        self._tell = tell
        self._goodbye = goodbye
        self._children: dict[str, _Child] = {}
        self._words: queue.SimpleQueue[tuple[str, str]] = queue.SimpleQueue()
        self._ports: dict[str, int] = {}
        self._signs: dict[str, float] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._children

    def names(self) -> list[str]:
        """The processes that run, in order of starting."""
        return list(self._children)

    def pid(self, name: str) -> int:
        """Process id; raises KeyError if no such process runs."""
        return self._children[name].process.pid

    def port(self, name: str) -> int | None:
        """The port that the process said it listens on, None before it did."""
        return self._ports.get(name)

    def spawn(self, name: str, module: str, order: Mapping[str, object]) -> None:
        """Start a process."""
        process = subprocess.Popen(
            [sys.executable, "-m", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
        assert process.stdin is not None
        process.stdin.write(json.dumps(order) + "\n")
        process.stdin.flush()
        listener = threading.Thread(target=self._listen, args=(name, process), daemon=True)
        self._ports.pop(name, None)
        self._children[name] = _Child(name, process, listener)
        listener.start()

    def await_ready(self, name: str, timeout: float) -> int:
        """Wait until the process says where it listens; the port.

        Raises:
            NotReadyError: it ended, or did not say so within `timeout` wall seconds.
        """
        end = self._clock.wall() + timeout
        child = self._children[name]
        said: list[str] = []
        while self._clock.wall() < end:
            self._take_words(0.1, said)
            if name in self._ports:
                for text in said:
                    self._tell(text)
                return self._ports[name]
            if child.process.poll() is not None and not child.listener.is_alive() and self._words.empty():
                break
        raise NotReadyError("; ".join(said) or f"{name} did not start")

    def rest(self, seconds: float) -> None:
        """Wait until something is said, at most `seconds` (wall), and pass it on."""
        said: list[str] = []
        self._take_words(max(0.0, seconds), said)
        for text in said:
            self._tell(text)

    def exits(self) -> list[Exit]:
        """Processes that have ended since the last call; what they said is passed on first."""
        self._pass_words_on()
        found = []
        for name, child in list(self._children.items()):
            status = child.process.poll()
            if status is not None:
                child.listener.join(1.0)
                self._pass_words_on()
                del self._children[name]
                found.append(Exit(name, child.process.pid, status))
        return found

    def end(self, names: Iterable[str], meanwhile: Callable[[], None] = lambda: None) -> None:
        """Ask processes to end, together, and see to it that they do; `meanwhile` is called all the time.

        One that says `ENDING` gets more time: on a busy machine ending takes what it takes. One that shows
        no sign is ended after `goodbye`, every one after `LONGEST_GOODBYE`.
        """
        waiting = [self._children[name] for name in names if name in self._children]
        began = self._clock.wall()
        for child in waiting:
            self._signs[child.name] = began
            if child.process.stdin is not None:
                with contextlib.suppress(OSError):  # it is gone already
                    child.process.stdin.close()
        while waiting:
            self.rest(_LOOK_AGAIN)
            meanwhile()
            wall = self._clock.wall()
            for child in tuple(waiting):
                if child.process.poll() is None:
                    patience = min(self._signs[child.name] + self._goodbye, began + LONGEST_GOODBYE)
                    if wall < patience:
                        continue
                    child.process.kill()
                    child.process.wait()
                    self._tell(f"{child.name} did not end by itself within {wall - began:.0f} s")
                waiting.remove(child)
                child.listener.join(1.0)
                self._children.pop(child.name, None)
        self._pass_words_on()

    def kill(self, name: str) -> None:
        """End a process at once, as a power cut would."""
        self._children[name].process.kill()

    def _listen(self, name: str, process: subprocess.Popen[str]) -> None:
        # A thread per child: reading a pipe without blocking differs between platforms.
        assert process.stdout is not None
        for line in process.stdout:
            if line.strip():
                self._words.put((name, line.rstrip()))
        process.stdout.close()
        self._words.put((name, ""))  # wakes up whoever waits for its end

    def _take_words(self, wait: float, said: list[str]) -> None:
        try:
            name, line = self._words.get(timeout=wait) if wait > 0.0 else self._words.get_nowait()
        except queue.Empty:
            return
        self._hear(name, line, said)
        while not self._words.empty():
            self._hear(*self._words.get(), said)

    def _hear(self, name: str, line: str, said: list[str]) -> None:
        port = line.removeprefix(READY)
        if line.startswith(READY) and port.isdigit():
            self._ports[name] = int(port)
        elif line == ENDING:
            self._signs[name] = self._clock.wall()
        elif line:
            said.append(line if line.startswith(name) else f"{name}: {line}")

    def _pass_words_on(self) -> None:
        said: list[str] = []
        self._take_words(0.0, said)
        for text in said:
            self._tell(text)
