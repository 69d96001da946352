"""Every stored case of the opinion model, at its own tolerance."""

import json
from pathlib import Path

import numpy as np
import pytest

from opinion_engine.model import (
    Attention,
    Couplings,
    OpinionNetwork,
    input_value,
    strongest,
    weighted_decision,
)
from opinion_engine.simulation import simulate

CASES = [
    json.loads(p.read_text()) for p in sorted((Path(__file__).parents[1] / "data/opinion").glob("*.json"))
]


def cases(*kinds):
    chosen = [c for c in CASES if c["kind"] in kinds]
    assert chosen, kinds
    return pytest.mark.parametrize("case", chosen, ids=[c["id"] for c in chosen])


def network_of(case):
    if "A" in case:
        return OpinionNetwork(np.array(case["A"]), np.array(case["Abar"]), np.array(case["d"]))
    if "options" in case:
        return OpinionNetwork.from_couplings(
            case["adjacency"], couplings_of(case), resistance=np.array(case["d"])
        )
    return OpinionNetwork.homogeneous(
        case["adjacency"], case["N_o"], resistance=np.array(case["d"]), **case["homogeneous"]
    )


def couplings_of(case):
    order, options = case["order"], case["options"]
    own, heard = np.zeros((3, 3)), np.zeros((3, 3))
    for j, name in enumerate(order):
        own[j, j], heard[j, j] = options[name]["alpha"], options[name]["gamma"]
        for other, value in options[name]["beta"].items():
            own[j, order.index(other)] = value
        for other, value in options[name]["delta"].items():
            heard[j, order.index(other)] = value
    return Couplings(np.array([options[name]["d"] for name in order]), own, heard)


def attention_of(case):
    return Attention(**{k: v for k, v in case["attention"].items() if k != "mode"})


@cases("trajectory", "scenario")
def test_trajectories_follow_the_high_accuracy_integration(case):
    dynamic = case["attention"]["mode"] == "dynamic"
    motion = simulate(
        network_of(case),
        case["z0"],
        case["t"],
        attention=attention_of(case) if dynamic else None,
        u0=case["u0"] if dynamic else case["attention"]["u"],
        b=np.array(case["b"]),
    )
    assert np.abs(motion.z - np.array(case["expected"]["z"])).max() <= case["tolerance"]
    if "u" in case["expected"]:
        assert np.abs(motion.u - np.array(case["expected"]["u"])).max() <= case["tolerance"]
    assert [strongest(row) for row in motion.z[-1]] == case["expected"]["strongest"]


@cases("hill_table")
def test_attention_saturates_along_the_hill_curve(case):
    attention = Attention(u_min=case["u_min"], u_max=case["u_max"], y_th=case["y_th"], n=case["n"])
    assert np.abs(attention.saturation(case["y"]) - case["expected"]["S_u"]).max() <= case["tolerance"]


@cases("input_map")
def test_raw_inputs_map_to_utilities(case):
    b = [
        input_value(
            raw, case["input_min"], case["input_max"], case["input_gain"], case["input_function_type"]
        )
        for raw in case["raw"]
    ]
    assert b == pytest.approx(case["expected"]["b"], abs=case["tolerance"])


@cases("decision")
def test_the_largest_opinion_wins_and_the_lowest_index_breaks_ties(case):
    assert [strongest(z) for z in case["z"]] == case["expected"]["index"]


@cases("gcid_decision")
def test_the_chosen_option_weighs_the_behaviours(case):
    best, total = weighted_decision(case["e_zmax"], case["A_c"], case["W"], case["f"])
    assert list(best) == case["expected"]["argmax"]
    assert np.allclose(total, case["expected"]["utility"], rtol=0, atol=1e-12)
