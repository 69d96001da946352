"""Where we are deliberately better than the reference: what the golden cases then have to say.

Each entry names the fault and the part of behaviors.md that asks for the better behaviour. A correction
changes what is expected; it never drops a case, and the better value has a test of its own beside the
behaviour.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from behaviors.op_region_v24 import OpRegionV24
from behaviors.steering import speed_peak
from behaviors.way_back import way_back
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction, couple

Postings = list[list[Any]]


def corrected(case: dict[str, Any]) -> dict[str, Any]:
    """A golden case without the reference's faults; it is changed in place."""
    case["postings"] = [list(p) for p in case["postings"] if len(p) < 5]  # no retraction of nothing (B1)
    for block in case["behaviours"]:
        correct = CORRECTIONS.get(block["type"])
        if correct is not None:
            correct(case, dict(block["params"]))
    return case


def _station_known_at_once(case: dict[str, Any], parameters: dict[str, str]) -> None:
    """StationKeep knows its distance in its first running iteration; no hibernation is DISABLED (C3)."""
    stated = "station_pt" in parameters or parameters.get("center_activate") == "true"
    wanted: Postings = case["postings"]
    if not stated:  # no distance to a station that does not exist
        case["postings"] = [p for p in wanted if p[2] != "DIST_TO_STATION"]
        return
    kept: Postings = []
    for variable in ("DIST_TO_STATION", "PSKEEP_MODE"):
        first, second, *_ = [p for p in wanted if p[2] == variable]
        first[3] = second[3]
        wanted = [p for p in wanted if p is not second]
    if "hibernation_radius" not in parameters:
        modes = [p for p in wanted if p[2] == "PSKEEP_MODE"]
        modes[0][3] = "DISABLED"
        wanted = [p for p in wanted if p[2] != "PSKEEP_MODE" or p is modes[0]]
    begun = next(p[0] for p in wanted if p[2] == "DIST_TO_STATION")
    for posting in wanted:
        if posting[2] == "BHV_STATUS" and posting[0] == begun + 1:
            kept[[p[0] == begun and p[2] == "BHV_STATUS" for p in kept].index(True)][3] = posting[3]
        else:
            kept.append(posting)
    case["postings"] = kept


def _weight_is_pwt(case: dict[str, Any], parameters: dict[str, str]) -> None:
    """HeadingChange forgets to set its weight, which stays at 10 (C25)."""
    weight = float(parameters["pwt"])
    for trace in case["trace"]:
        trace["weights"] = dict.fromkeys(trace["weights"], weight)
    for posting in case["postings"]:
        if posting[2] == "BHV_STATUS":
            posting[3] = posting[3].replace("pwt=10.00000", f"pwt={weight:.5f}")


def _bias_is_a_side(case: dict[str, Any], parameters: dict[str, str]) -> None:
    """HeadingBias is flat and knows only the right; a side is everything up to 180 degrees off the bow (C25)."""
    heading = [step for step in case["steps"] if "own" in step][-1]["own"]["heading"]
    right = parameters.get("bias", "right") == "right"
    function = case["functions"][case["target"]]
    function["utility"] = [
        100.0 if ((course - heading) if right else (heading - course)) % 360.0 <= 180.0 else 0.0
        for course in range(360)
    ]
    for posting in case["postings"]:
        if posting[2] == "BHV_STATUS":  # a step up and a step down make three pieces of a circle
            posting[3] = posting[3].replace("pcs=1,", "pcs=3,")


def _turn_from_the_first_moment(case: dict[str, Any], parameters: dict[str, str]) -> None:
    """LegRun steers for the other end of the leg in the very iteration in which a turn begins (C17)."""
    other_end = "x=100,y=0,label=alpha's next waypoint"
    points = [p for p in case["postings"] if "'s next waypoint" in str(p[3])]
    wrong = next(p for p in points if str(p[3]).startswith(other_end))
    right = points[points.index(wrong) + 1]
    wrong[3] = right[3]
    case["postings"] = [p for p in case["postings"] if p is not right]


CORRECTIONS: dict[str, Callable[[dict[str, Any], dict[str, str]], None]] = {
    "BHV_StationKeep": _station_known_at_once,
    "BHV_HeadingChange": _weight_is_pwt,
    "BHV_HeadingBias": _bias_is_a_side,
    "BHV_LegRun": _turn_from_the_first_moment,
}


def comparable_function(behavior: Behavior, function: IvPFunction, iteration: int) -> IvPFunction:
    """The function with the reference's fault put in, where a fault shows in every utility."""
    if isinstance(behavior, OpRegionV24):
        # The reference's weights of course and speed go around with the iteration (C5); ours are 80 : 20.
        weights = ((95.0, 5.0), (80.0, 20.0), (50.0, 50.0), (20.0, 80.0), (5.0, 95.0))[iteration % 5]
        own, speed = behavior.own, behavior.config.recover_spd
        back = way_back(behavior.domain, behavior.regions["save"], own.x, own.y, own.heading, behavior._side)
        return couple(back.course, speed_peak(behavior.domain, speed, speed / 2.0, 0.2, 20.0), *weights)
    return function
