"""A study that is asked to end takes its workers with it."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

STUDY = """
study: endless
mission: bloom
duration: 1000000
presets: [paper, quiet]
seeds: {first: 1, count: 4}
grid:
  vehicles: [2]
measure:
  metres: sum N_ODOM_BLOOM_CTRL
"""
PATIENCE = 60.0


def workers_of(parent):
    """Its workers that are at work: Python's own helper among the children is idle."""
    return [child for child in parent.children() if "spawn_main" in " ".join(child.cmdline())]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows ends processes without asking them")
@pytest.mark.parametrize("asked", [signal.SIGTERM, signal.SIGINT], ids=lambda number: number.name)
def test_a_study_asked_to_end_leaves_no_worker_behind(asked, tmp_path):
    file = tmp_path / "endless.yaml"
    file.write_text(STUDY)
    command = [sys.executable, "-m", "pymoos_lite.tools.cli", "monte", str(file), "--workers", "2"]
    # With Ctrl-C ignored, as a shell starts jobs in the background.
    shell = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]
    study = subprocess.Popen(
        [*shell, *command, "--out", str(tmp_path / "out")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    workers = []
    try:
        parent = psutil.Process(study.pid)
        end = time.monotonic() + PATIENCE
        while len(workers) < 2:
            assert study.poll() is None
            assert time.monotonic() < end
            workers = workers_of(parent)
        study.send_signal(asked)
        assert study.wait(PATIENCE) != 0
        assert psutil.wait_procs(workers, timeout=PATIENCE)[1] == []
    finally:
        for process in (study, *workers):
            if isinstance(process, psutil.Process) and not process.is_running():
                continue
            process.kill()
        study.wait(PATIENCE)
