"""What the README shows is true."""

import re
from pathlib import Path

import pytest

from ivp_helm.testing import check_behavior
from pymoos_lite.tools.cli import COMMANDS

README = Path(__file__).parents[1] / "README.md"


@pytest.fixture(scope="module")
def text():
    return README.read_text(encoding="utf-8")


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S)


def test_it_opens_with_two_set_up_commands(text):
    shell = blocks(text, "sh")
    assert shell[0].startswith("python3 -m venv .venv && ")
    assert "pymoos-launch alpha" in shell[0]
    assert shell[1].startswith("python3 -m venv .venv && ")
    assert "pytest" in shell[1]
    assert all(len(block.strip().splitlines()) == 1 for block in shell[:2])


def test_the_behaviour_it_prints_keeps_the_contract(text):
    source = blocks(text, "python")[0]
    assert len(source.strip().splitlines()) <= 22
    names = {}
    exec(source, names)
    check_behavior(names["HoldDepth"], parameters={"depth": 10.0})


def test_every_command_it_names_exists(text):
    named = set(re.findall(r"pymoos ([a-z]+)\b", text))
    assert named <= COMMANDS.keys()
    assert {"sim", "scope", "poke", "check", "log", "list", "help"} <= named
