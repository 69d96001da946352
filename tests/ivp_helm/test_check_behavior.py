"""`check_behavior` finds every kind of broken behaviour, and passes a sound one."""

from __future__ import annotations

import random
import time

import pytest

from ivp_helm.behavior import Behavior
from ivp_helm.contract import ContractError
from ivp_helm.ivp import Domain, IvPFunction, Peak, zaic_peak
from ivp_helm.testing import check_behavior
from pymoos_lite.config.parameters import Declaration, Parameter


class Sound(Behavior):
    """Goes at a speed."""

    BHV_NAME = "BHV_Sound"
    VARIABLES = ("speed",)
    PARAMETERS = Declaration((Parameter("speed", "number", 1.0, "m/s", "Speed to go at.", low=0.0),))

    def on_run(self) -> IvPFunction | None:
        self.post("SPEED_WANTED", self.config.speed)
        return zaic_peak(self.domain, "speed", Peak(self.config.speed, 0, 1))


def test_a_sound_behaviour_passes():
    check_behavior(Sound)
    check_behavior(Sound, {"speed": 3})


def broken(**members: object) -> type[Behavior]:
    return type("Broken", (Sound,), {"__doc__": "Broken.", "BHV_NAME": "BHV_Broken", **members})


def _raises(self):
    raise ValueError("no")


def _prints(self):
    print("hello")
    return Sound.on_run(self)


def _sleeps(self):
    time.sleep(0.0)
    return Sound.on_run(self)


def _gambles(self):
    return zaic_peak(self.domain, "speed", Peak(random.random(), 0, 1))


def _remembers(self):
    type(self).calls = getattr(type(self), "calls", 0) + 1
    self.post("CALLS", type(self).calls)
    return Sound.on_run(self)


def _chatters(self):
    self.post("STILL_IDLE", self.now)


def _meddles(self):
    self.buffer.set("OTHER", self.now)
    return Sound.on_run(self)


def _wanders(self):
    return zaic_peak(Domain.parse("height,0,9,10"), "height", Peak(3, 0, 1))


def _leaves_gaps(self):
    return IvPFunction(self.domain.subdomain("speed"), [[0]], [[3]], [[0.0, 50.0]])


def _exaggerates(self):
    return zaic_peak(self.domain, "speed", Peak(1, 0, 1, 0, 0, 1e9))


@pytest.mark.parametrize(
    ("members", "clause"),
    [
        ({"on_run": _raises}, "it runs without errors"),
        ({"on_run": _prints}, "it does no I/O (it called builtins.print)"),
        ({"on_run": _sleeps}, "it does no I/O (it called time.sleep)"),
        ({"on_run": _gambles}, "it does no I/O (it called random.random)"),
        ({"on_run": _remembers}, "the same inputs give the same functions and posts"),
        ({"on_idle": _chatters}, "idle, with nothing changing, it posts nothing (posted STILL_IDLE)"),
        ({"on_run": _meddles}, "it changes the information buffer only by posting (OTHER)"),
        ({"on_run": _wanders}, "functions are over variables of the helm's domain"),
        ({"on_run": _leaves_gaps}, "functions cover every point of their domain"),
        ({"on_run": _exaggerates}, "utilities are of the order of 0 to 100"),
        ({"__doc__": None}, "the class has a docstring"),
        ({"BHV_NAME": "Broken"}, "BHV_NAME begins with 'BHV_'"),
        (
            {"PARAMETERS": Declaration((Parameter("speed", "number", 1.0, "m/s"),))},
            "'speed' has a line of doc",
        ),
        (
            {"PARAMETERS": Declaration((Parameter("speed", "number", -1.0, "m/s", "Speed.", low=0.0),))},
            "the default of 'speed' is finite and a legal value",
        ),
        ({"VARIABLES": ("speed", "tilt")}, "it runs without errors"),
    ],
)
def test_a_broken_behaviour_is_told_what_it_broke(members, clause):
    with pytest.raises(ContractError) as caught:
        check_behavior(broken(**members))
    assert clause in str(caught.value)


def test_parameters_that_do_not_fit_are_told():
    with pytest.raises(ContractError, match="it can be made with the parameters given"):
        check_behavior(Sound, {"sped": 3})
