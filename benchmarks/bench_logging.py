"""What logging, log reading and conditions cost.

Baselines, measured in the same run: for writing, one formatted line written to the file per message (what a first
version of a logger does); for reading, a regular expression per line; for conditions, parsing the text each time.

    python benchmarks/bench_logging.py
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from pymoos_lite.app import AppContext
from pymoos_lite.apps.logger import Logger
from pymoos_lite.config.conditions import parse_condition
from pymoos_lite.core.clock import VirtualClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.records.alog import read_entries

BATCHES, BATCH = 1000, 100
TEXT = "NAME=abe,X=12.1,Y=-3.5,SPD=1.2,HDG=180,DEP=0,TYPE=kayak,GROUP=red,MODE=ACTIVE:SURVEYING,TIME=1767225600.5"
CONDITION = "((MODE == ACTIVE) and (NAV_DEPTH < 2)) or !(DEPLOY = true)"
LINE = re.compile(r"^(-?[\d.]+)\s+(\S+)\s+(\S+)\s+(.*?)\s*$")


def messages() -> list[Message]:
    """A batch like those of a sailing vessel: mostly numbers, a tenth of them texts, some with an aux."""
    now = VirtualClock().now()
    batch = []
    for i in range(BATCH):
        aux = f"{i}:waypt_survey" if i % 7 == 0 else ""
        value = TEXT if i % 10 == 0 else i * 1.2345
        batch.append(Message(f"VARIABLE_{i}", value, now + 0.01 * i, "pSomething", aux, "abe"))
    return batch


def best_of(run: Callable[[], object], repeats: int = 5) -> float:
    best = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - began)
    return best


def make_logger(folder: Path) -> Logger:
    clock = VirtualClock()
    connection = LocalConnection(Database("abe", clock.now()), "pLogger", clock)
    logger = Logger(
        AppContext("pLogger", "abe", clock, connection, log_dir=folder, has_block=False, deterministic=True)
    )
    logger.on_start_up()
    return logger


def write_ours(folder: Path, batch: list[Message]) -> None:
    logger = make_logger(folder)
    for _ in range(BATCHES):
        logger.on_mail(batch)
    logger.on_quit()


def write_plainly(folder: Path, batch: list[Message]) -> None:
    start = batch[0].time
    with (folder / "plain.alog").open("w", encoding="utf-8", buffering=1) as file:
        for _ in range(BATCHES):
            for m in batch:
                value = f"{m.value:<12.5f}" if isinstance(m.value, float) else str(m.value).replace("\n", " ")
                file.write(f"{m.time - start:<15.5f} {m.name:<20} {m.origin:<15} {value} \n")


def read_plainly(lines: list[str]) -> int:
    count = 0
    for line in lines:
        match = LINE.match(line)
        if match is not None:
            with suppress(ValueError):
                float(match[4])
            count += 1
    return count


def row(what: str, ours: float, baseline: float, name: str, unit: str, count: int) -> None:
    print(
        f"{what:<28} {1e6 * ours / count:>8.2f} us/{unit:<10} {name}: {1e6 * baseline / count:>8.2f} us   "
        f"ratio {baseline / ours:>6.2f}"
    )


def main() -> None:
    batch = messages()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count = BATCHES * BATCH
        ours = best_of(lambda: write_ours(folder, batch), 3)
        plain = best_of(lambda: write_plainly(folder, batch), 3)
        row("logging a message", ours, plain, "line by line", "message", count)
        lines = (folder / "plain.alog").read_text().splitlines()
        ours = best_of(lambda: sum(1 for _ in read_entries(lines)), 3)
        plain = best_of(lambda: read_plainly(lines), 3)
        row("reading an entry", ours, plain, "regular expression", "entry", count)
    values: dict[str, float | str | bytes] = {"MODE": "ACTIVE:SURVEYING", "NAV_DEPTH": 1.0, "DEPLOY": "true"}
    condition = parse_condition(CONDITION)
    rounds = 20_000
    ours = best_of(lambda: [condition.holds(values.get) for _ in range(rounds)])
    plain = best_of(lambda: [parse_condition(CONDITION).holds(values.get) for _ in range(rounds)], 2)
    row("evaluating a condition", ours, plain, "parsing it each time", "condition", rounds)


if __name__ == "__main__":
    main()
