"""The behaviour of the handbook works as printed: its test passes and a mission sails it."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import pytest

from ivp_helm.behavior_file import read_behavior_file
from ivp_helm.helm import HelmCore
from ivp_helm.ivp import parse_entry
from ivp_helm.plugins import BehaviorFinder
from ivp_helm.settings import HelmSettings

HANDBOOK = Path(__file__).parents[2] / "docs" / "behaviors.md"
BLOCK = re.compile(r"```(\w+)(?: file=(\S+))?\n(.*?)```", re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for _, name, text in BLOCK.findall(HANDBOOK.read_text()):
        if name:
            (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "hold_depth", raising=False)
    return tmp_path


def test_the_printed_test_passes(folder: Path):
    names = runpy.run_path(str(folder / "test_hold_depth.py"))
    tests = [value for name, value in names.items() if name.startswith("test_")]
    assert len(tests) == 2
    for test in tests:
        test()


def test_the_printed_block_is_understood_and_runs(folder: Path):
    text = next(body for kind, _, body in BLOCK.findall(HANDBOOK.read_text()) if kind == "bhv")
    settings = HelmSettings(entries=(parse_entry("depth:0:100:101"),), start_in_drive=True, settle=0.0)
    core = HelmCore(settings, read_behavior_file(text, "a.bhv"), BehaviorFinder([folder]))
    assert core.problems == ()
    assert [life.name for life in core.population] == ["hold"]
    assert {"DIVE", "HOLD_UPDATES"} <= set(core.population.lives[0].behavior.variables_needed())


def test_the_printed_behaviour_has_about_twenty_lines():
    source = next(body for _, name, body in BLOCK.findall(HANDBOOK.read_text()) if name == "hold_depth.py")
    assert len(source.splitlines()) <= 20
