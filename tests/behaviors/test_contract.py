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
    "BHV_Loiter": {"polygon": "format=radial,x=20,y=-10,radius=30,pts=6", "speed": 2, "clockwise": "best"},
    "BHV_StationKeep": {"station_pt": "5,5", "hibernation_radius": 30},
    "BHV_ConstantHeading": {"heading": 80, "duration": "no-time-limit", "heading_mismatch_var": "MISMATCH"},
    "BHV_ConstantDepth": {"depth": 4, "duration": "no-time-limit", "depth_mismatch_var": "MISMATCH"},
    "BHV_OpRegionV24": {"core_poly": "pts={-20,-20:20,-20:20,20:-20,20}", "save_dist": 5},
    "BHV_GoToDepth": {"depth": "3,1:6:2,2", "repeat": 3, "capture_flag": "ARRIVED"},
    "BHV_MaxSpeed": {"max_speed": 2, "speed_slack_var": "SLACK"},
    "BHV_MaxDepth": {"max_depth": 5, "depth_slack_var": "SLACK"},
    "BHV_MinAltitudeX": {"min_altitude": 5, "missing_altitude_critical": "false"},
    "BHV_OpRegion": {"polygon": "pts={-500,-500:500,-500:500,500:-500,500}", "max_time": 100},
    "BHV_OpRegionRecover": {"polygon": "pts={-20,-20:20,-20:20,20:-20,20}", "trigger_entry_time": 0.2},
    "BHV_MemoryTurnLimit": {"memory_time": 3, "turn_range": 60},
    "BHV_ZigZag": {
        "speed": 2,
        "zig_angle": 30,
        "max_zig_legs": 6,
        "perpetual": "true",
        "stem_on_active": "true",
    },
    "BHV_LegRun": {"leg": "0:0:45:60", "turn_rad": 12, "speed": 2, "lead": 8, "leg_spds": "2:1.5,3"},
    "BHV_FixedTurn": {"fix_turn": 40, "turn_delay": 0.5, "perpetual": "true"},
    "BHV_FullStop": {"perpetual": "true", "delay_complete": 1},
    "BHV_PeriodicSpeed": {"period_lazy": 1, "period_busy": 2, "period_speed": 1.5},
    "BHV_PeriodicSurface": {"period": 2, "max_time_at_surface": 1, "zero_speed_depth": 3},
    "BHV_RStationKeep": {"contact": "ben", "rstation_position": "20,180"},
    "BHV_MaintainHeading": {"duration": "no-time-limit"},
    "BHV_HeadingBias": {"bias": "left"},
    "BHV_Hysteresis": {"memory_time": 2},
    "BHV_HeadingHysteresis": {"memory_time": 2},
    "BHV_AbortToPoint": {"point": "30,40", "speed": 2},
    "BHV_ConstantSpeed": {"speed": 2, "duration": "no-time-limit", "speed_mismatch_var": "MISMATCH"},
    "BHV_AvoidCollision": {"contact": "ben", "post_per_contact_info": "true", "max_util_cpa_dist": 40},
    "BHV_AvoidObstacleV24": {
        "polygon": "format=radial,x=40,y=30,radius=12,pts=8,label=rock_1",
        "id": "rock_1",
        "completed_dist": 2000,
        "pwt_outer_dist": 200,
        "rng_flag": "<30 NEAR=$[RNG]",
    },
    "BHV_CutRange": {"contact": "ben", "pwt_outer_dist": 100, "giveup_range": 200, "patience": 40},
    "BHV_Trail": {"contact": "ben", "trail_range": 20, "pwt_outer_dist": 500},
    "BHV_Shadow": {"contact": "ben"},
    "BHV_Convoy": {"contact": "ben"},
}
"""Parameters with which a behaviour does something; others are checked with their defaults."""

WITH_DEPTH = {"domain": ("course:0:359:72", "speed:0:4:9", "depth:0:20:21")}
BEN = {"contacts": ({"name": "ben", "x": 30.0, "y": 40.0, "heading": 200.0, "speed": 1.2},)}
OPTIONS: dict[str, dict[str, Any]] = {
    **dict.fromkeys(("BHV_AvoidCollision", "BHV_CutRange", "BHV_Trail", "BHV_Shadow", "BHV_Convoy"), BEN),
    "BHV_ConstantDepth": WITH_DEPTH,
    "BHV_GoToDepth": WITH_DEPTH,
    "BHV_MaxDepth": WITH_DEPTH,
    "BHV_MinAltitudeX": WITH_DEPTH,
    "BHV_PeriodicSurface": {**WITH_DEPTH, "clocks": ("PENDING_SURFACE",)},
    "BHV_Timer": {"clocks": ("TIMER_IDLE",)},
}
"""Domain or contacts where the usual ones do not do."""


@pytest.mark.parametrize("entry", BEHAVIORS, ids=lambda entry: entry.name)
def test_the_behaviour_keeps_the_contract(entry):
    check_behavior(load_target(entry.target), PARAMETERS.get(entry.name), **OPTIONS.get(entry.name, {}))


@pytest.mark.parametrize("entry", BEHAVIORS, ids=lambda entry: entry.name)
def test_the_catalogue_names_the_behaviour_as_it_names_itself(entry):
    assert entry.name == load_target(entry.target).BHV_NAME
    assert entry.doc
