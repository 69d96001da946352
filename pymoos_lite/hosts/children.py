"""Processes that a host starts, listens to and ends.

Each is a module run with this Python, told what to do by one line of JSON on its stdin; the end of its
stdin tells it to end. What it prints is passed on; a line that begins with READY says where it listens.
"""

from __future__ import annotations

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
"""Wall seconds that processes are given to end in an orderly way before they are ended."""


class NotReadyError(Exception):
    """A process ended, or said nothing in time, instead of becoming ready; the text is what it said."""


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

    `goodbye` is how long (wall seconds) they may take to end when asked to.
    """

    def __init__(self, clock: Clock, tell: Callable[[str], None], goodbye: float = GOODBYE) -> None:
        self._clock = clock
        self._tell = tell
        self._goodbye = goodbye
        self._children: dict[str, _Child] = {}
        self._words: queue.SimpleQueue[tuple[str, str]] = queue.SimpleQueue()
        self._ports: dict[str, int] = {}

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

    def end(self, names: Iterable[str]) -> None:
        """Ask processes to end, together, and see to it that they do."""
        children = [self._children[name] for name in names if name in self._children]
        for child in children:
            if child.process.stdin is not None:
                try:
                    child.process.stdin.close()
                except OSError:
                    continue  # it is gone already
        end = self._clock.wall() + self._goodbye
        for child in children:
            try:
                child.process.wait(max(0.05, end - self._clock.wall()))
            except subprocess.TimeoutExpired:
                child.process.kill()
                child.process.wait()
                self._tell(f"{child.name} did not end by itself within {self._goodbye:g} s")
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
        else:
            said.append(line if line.startswith(name) else f"{name}: {line}")

    def _pass_words_on(self) -> None:
        said: list[str] = []
        self._take_words(0.0, said)
        for text in said:
            self._tell(text)
