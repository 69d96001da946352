"""One community of a fleet in a process of its own: ``python -m pymoos_lite.hosts.member``.

The description of what to run comes in on stdin, and the end of stdin means that the launcher is gone or
wants the community to end.
"""

from __future__ import annotations

import gc
import json
import signal
import sys
import threading
from pathlib import Path

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.children import READY
from pymoos_lite.hosts.failures import describe_failure
from pymoos_lite.hosts.fleet import plan_member
from pymoos_lite.hosts.mission import MissionError
from pymoos_lite.hosts.ports import PortError
from pymoos_lite.hosts.realtime import HostOptions, RealtimeHost
from pymoos_lite.hosts.remote import FAILED_STATUS, stop_with_stdin


def main() -> int:
    """Entry point of the process; returns its exit status."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is the launcher's business
    order = json.loads(sys.stdin.readline())
    files = {kind: Path(path) for kind, path in order["files"].items()}
    try:
        plan, _ = plan_member(files, Path(order["folder"]), order["settings"])
        options = HostOptions(
            bind=order["bind"],
            port=order["port"],
            key=order["key"],
            log_dir=Path(order["log_dir"]) if order["log_dir"] else None,
            restart=order["restart"],
            seed=order["seed"],
            share_bind=order["share_bind"],
        )
        host = RealtimeHost(plan, options, RealClock(order["warp"]), _tell)
        host.prepare()
    except (MissionError, PortError) as error:
        _tell(str(error))
        return FAILED_STATUS
    print(f"{READY}{host.port}", flush=True)
    ended = threading.Event()
    stop_with_stdin(ended.set)
    try:
        host.start_apps()
        # What was imported stays: at a high warp a look through all of it would cost many ticks.
        gc.collect()
        gc.freeze()
        host.run(ended.is_set)
    except Exception as error:
        _tell(str(describe_failure(plan.community, "the host", error, "its loop")))
        return FAILED_STATUS
    finally:
        host.close()
    return FAILED_STATUS if host.failures else 0


def _tell(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    sys.exit(main())
