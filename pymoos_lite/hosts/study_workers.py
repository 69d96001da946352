"""Who does the runs of a study: processes of this machine, or a Dask cluster.

Both are generators of outcomes, in the order in which they are ready. A worker that dies loses nothing: its
row goes to another one, up to `ATTEMPTS` times, and then counts as failed.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from pymoos_lite.hosts.study import Outcome, run_text

Work = Callable[[str, str, int], dict[str, Any]]
"""What is done with a row: text and file of the study and number of the row in; its ``row`` and ``status``, and
whatever else was found, out, as JSON knows it. It is sent to other processes: a function of a module."""

ATTEMPTS = 3
FAREWELL = 5.0
"""Wall seconds that a worker is given to end before it is ended."""


def default_workers() -> int:
    """One for each processor this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return max(1, os.cpu_count() or 1)


def run_here(text: str, file: str, numbers: Sequence[int]) -> Iterator[Outcome]:
    """One run after the other, in this process."""
    for number in numbers:
        yield Outcome.from_json(run_text(text, file, number))


def lost(number: int) -> Outcome:
    """The outcome of a row whose workers died again and again."""
    return Outcome(number, f"failed: its worker died {ATTEMPTS} times", {})


# --- processes ------------------------------------------------------------------------------------


def _serve(pipe: Connection, work: Work, text: str, file: str) -> None:
    """A worker process: rows come in, what was found goes out, None ends it."""
    with contextlib.suppress(EOFError, KeyboardInterrupt, BrokenPipeError):
        while (number := pipe.recv()) is not None:
            pipe.send(work(text, file, number))


class _Worker:
    """One process and the row it works at."""

    def __init__(self, work: Work, text: str, file: str) -> None:
        # Spawned, not forked: the same on every platform, and no thread of ours is copied half-way.
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(
            target=_serve, args=(theirs, work, text, file), daemon=True
        )
        self.process.start()
        theirs.close()
        self.row: int | None = None

    def give(self, number: int) -> bool:
        """Hand over a row; False if the worker is gone."""
        self.row = number
        try:
            self.pipe.send(number)
        except (BrokenPipeError, OSError):
            return False
        return True

    def take(self) -> dict[str, Any] | None:
        """What is ready; None if the worker died instead."""
        try:
            answer: dict[str, Any] = self.pipe.recv()
        except (EOFError, OSError):
            return None
        self.row = None
        return answer

    def end(self, at_once: bool = False) -> None:
        with contextlib.suppress(OSError):
            if not at_once and self.process.is_alive():
                self.pipe.send(None)
        if at_once:
            self.process.terminate()
        self.process.join(FAREWELL)
        if self.process.is_alive():
            self.process.kill()
            self.process.join(FAREWELL)
        self.pipe.close()


class ProcessWorkers:
    """A pool of processes; `pids` are those at work, for whoever wants to watch them."""

    def __init__(self, text: str, file: str, count: int, work: Work = run_text) -> None:
        self._work, self._text, self._file = work, text, file
        self._count = count
        self._workers: list[_Worker] = []

    @property
    def pids(self) -> list[int]:
        return [worker.process.pid or 0 for worker in self._workers]

    def run(self, numbers: Sequence[int]) -> Iterator[Outcome]:
        """The outcomes of all rows, each as it is ready."""
        with contextlib.closing(self.answers(numbers)) as answers:
            for answer in answers:
                yield Outcome.from_json(answer)

    def answers(self, numbers: Sequence[int]) -> Generator[dict[str, Any], None, None]:
        """What the work came to for each row, as it is ready."""
        waiting = deque(numbers)
        attempts = dict.fromkeys(numbers, 0)
        finished = False
        try:
            while waiting or any(worker.row is not None for worker in self._workers):
                yield from self._hand_out(waiting, attempts)
                yield from self._collect(waiting)
            finished = True
        finally:
            for worker in self._workers:
                worker.end(at_once=not finished)
            self._workers = []

    def _hand_out(self, waiting: deque[int], attempts: dict[int, int]) -> Iterator[dict[str, Any]]:
        idle = [worker for worker in self._workers if worker.row is None]
        while waiting and (idle or len(self._workers) < self._count):
            number = waiting.popleft()
            attempts[number] += 1
            if attempts[number] > ATTEMPTS:
                yield lost(number).to_json()
                continue
            if idle:
                worker = idle.pop()
            else:
                worker = _Worker(self._work, self._text, self._file)
                self._workers.append(worker)
            if not worker.give(number):
                self._bury(worker, waiting)

    def _collect(self, waiting: deque[int]) -> Iterator[dict[str, Any]]:
        busy = {worker.pipe: worker for worker in self._workers if worker.row is not None}
        for ready in wait(list(busy)) if busy else ():
            worker = busy[ready]  # type: ignore[index]
            answer = worker.take()
            if answer is None:
                self._bury(worker, waiting)
            else:
                yield answer

    def _bury(self, worker: _Worker, waiting: deque[int]) -> None:
        if worker.row is not None:
            waiting.append(worker.row)
        worker.end(at_once=True)
        self._workers.remove(worker)


# --- Dask -----------------------------------------------------------------------------------------


class DaskMissingError(RuntimeError):
    """dask.distributed is not installed."""


def run_on_dask(text: str, file: str, numbers: Sequence[int], address: str) -> Iterator[Outcome]:
    """All rows on the cluster whose scheduler is at `address` (``tcp://host:8786``).

    The workers need this package and the mission. The scheduler gives the rows of a dead worker to others.

    Raises:
        DaskMissingError: dask.distributed is not installed.
        OSError: the scheduler cannot be reached.
    """
    try:
        dask: Any = importlib.import_module("distributed")
    except ImportError:
        raise DaskMissingError("--dask needs dask.distributed: pip install 'pymoos-lite[dask]'") from None
    client = dask.Client(address, set_as_default=False)
    try:
        rows: dict[str, int] = {}
        futures = []
        for number in numbers:
            future = client.submit(run_text, text, file, number, pure=False, retries=ATTEMPTS)
            rows[future.key] = number
            futures.append(future)
        for future in dask.as_completed(futures, loop=client.loop):
            error = future.exception()
            if error is None:
                yield Outcome.from_json(future.result())
            else:
                first = (str(error) or type(error).__name__).splitlines()[0]
                yield Outcome(rows[future.key], f"failed: {first}", {})
            future.release()
    finally:
        client.close()
