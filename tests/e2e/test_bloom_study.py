"""A study of the bloom mission: the same bytes whoever does the runs, in whatever order."""

import random

import pytest

from pymoos_lite.config.study_file import parse_study
from pymoos_lite.hosts.study_journal import Journal, table_text
from pymoos_lite.hosts.study_workers import ProcessWorkers, run_here, run_on_dask

STUDY = """
study: short
mission: bloom
duration: 60
presets: [paper, quiet]
seeds: {first: 1, count: 1}
grid:
  vehicles: [2]
  method: [gcid, static, greedy]
measure:
  metres: sum N_ODOM_BLOOM_CTRL
  mixed: shoreside MIXED_STRAT_RNG_AVG
  changes: sum OPTION_CHANGES
  attention: sum OWN_ATTENTION
  opinion_bytes: sum OPINION_BYTES
  network_bytes: network bytes
  closest: shoreside UCD_CLOSEST_RANGE_EVER
watch: [closest]
"""
NUMBERS = (1, 2, 3)


def table(folder, outcomes):
    """The table as `pymoos monte` would write it."""
    study = parse_study(STUDY, str(folder / "short.yaml"))
    assert study.problems == ()
    journal = Journal(folder, STUDY)
    for outcome in outcomes:
        assert outcome.status == "ok"
        journal.add(outcome)
    journal.close()
    return table_text(study, journal)


@pytest.fixture(scope="module")
def one_process(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    return table(folder, run_here(STUDY, str(folder / "short.yaml"), NUMBERS))


@pytest.mark.slow
def test_the_methods_differ_and_every_column_is_measured(one_process):
    lines = [line.split(",") for line in one_process.splitlines()]
    assert len(lines) == 4
    assert all(cell != "" for line in lines for cell in line)
    assert len({tuple(line[5:9]) for line in lines[1:]}) == 3


@pytest.mark.slow
def test_two_processes_in_another_order_give_the_same_bytes(one_process, tmp_path):
    numbers = list(NUMBERS)
    random.Random(2).shuffle(numbers)
    assert numbers != list(NUMBERS)
    assert table(tmp_path, ProcessWorkers(STUDY, str(tmp_path / "short.yaml"), 2).run(numbers)) == one_process


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_bytes(one_process, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        outcomes = run_on_dask(STUDY, str(tmp_path / "short.yaml"), NUMBERS, cluster.scheduler_address)
        assert table(tmp_path, outcomes) == one_process
