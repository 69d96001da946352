"""A study on a real Dask cluster of several worker processes, one of which is killed in the middle."""

import os
import signal

import pytest
from study_fixture import STUDY, write_study

from pymoos_lite.hosts.study_workers import run_here, run_on_dask

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as made:
        yield made


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_numbers_and_a_killed_worker_loses_no_run(tmp_path, cluster):
    path = write_study(tmp_path, STUDY + "macros: {NAP: 0.02}\n")
    text = path.read_text()
    numbers = range(1, 17)
    here = {o.row: (o.status, dict(o.values)) for o in run_here(text, str(path), numbers)}
    with distributed.Client(cluster, set_as_default=False) as client:
        pids = list(client.run(os.getpid).values())
    assert len(set(pids)) == 3
    found = {}
    for outcome in run_on_dask(text, str(path), numbers, cluster.scheduler_address):
        found[outcome.row] = (outcome.status, dict(outcome.values))
        if len(found) == 4:
            os.kill(pids[0], getattr(signal, "SIGKILL", signal.SIGTERM))
    assert found == here


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_told_in_one_line(tmp_path, capsys, monkeypatch):
    from pymoos_lite.tools import cli

    path = write_study(tmp_path)
    import dask

    with dask.config.set({"distributed.comm.timeouts.connect": "1s"}):
        words = [
            "monte",
            str(path),
            "--out",
            str(tmp_path / "out"),
            "--dask",
            "tcp://127.0.0.1:1",
            "--no-progress",
        ]
        assert cli.main(words) == 1
    error = capsys.readouterr().err
    assert "--dask tcp://127.0.0.1:1" in error
