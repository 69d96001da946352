"""Every registered behaviour keeps the contract."""

from __future__ import annotations

from typing import Any

import pytest

from ivp_helm.testing import check_behavior
from pymoos_lite.config.catalogue import BEHAVIORS
from pymoos_lite.config.registry import load_target

PARAMETERS: dict[str, dict[str, Any]] = {
    "BHV_Waypoint": {
        "points": "0,0:50,20:80,-40:0,0",
        "speed": 2,
        "lead": 8,
        "repeat": 3,
        "capture_line": "true",
    },
    "BHV_ConstantSpeed": {"speed": 2, "duration": "no-time-limit", "speed_mismatch_var": "MISMATCH"},
}
"""Parameters with which a behaviour does something; others are checked with their defaults."""

OPTIONS: dict[str, dict[str, Any]] = {}
"""Domain or contacts where the usual ones do not do."""


@pytest.mark.parametrize("entry", BEHAVIORS, ids=lambda entry: entry.name)
def test_the_behaviour_keeps_the_contract(entry):
    check_behavior(load_target(entry.target), PARAMETERS.get(entry.name), **OPTIONS.get(entry.name, {}))


@pytest.mark.parametrize("entry", BEHAVIORS, ids=lambda entry: entry.name)
def test_the_catalogue_names_the_behaviour_as_it_names_itself(entry):
    assert load_target(entry.target).BHV_NAME == entry.name
    assert entry.doc
