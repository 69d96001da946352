"""Load (or, the first time ever, compile) every kernel before the first decision is due."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp.codec import encode
from ivp_helm.ivp.coupler import CoupledPeak, couple
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.function import constant
from ivp_helm.ivp.reflector import reflect
from ivp_helm.ivp.solver import Method, solve
from ivp_helm.ivp.tabled import from_table
from ivp_helm.ivp.zaic import Peak, zaic_hdg, zaic_leq, zaic_peak, zaic_spd

_warm = False


def _slant(course: NDArray[np.float64], speed: NDArray[np.float64]) -> NDArray[np.float64]:
    return course + speed


def warm_up() -> None:
    """Run every builder and the solver once on a tiny domain.

    Takes well under a second once the compile cache is filled, and nothing when called again. A program
    that decides under a deadline calls this while it starts, never inside its first decision.
    """
    global _warm  # noqa: PLW0603 - once per process is the meaning
    if _warm:
        return
    domain = Domain.parse("course,0,350,36:speed,0,4,11:depth,0,50,11")
    course = zaic_peak(domain, "course", Peak(270, basewidth=180), wrap=True)
    speed = zaic_spd(domain, "speed", 2, 1, 3, 50, 50)
    zaic_hdg(domain, "course", 90, 20, 20)
    CoupledPeak(domain, "course", Peak(basewidth=180), speed, wrap=True).at(270.0)
    joint = couple(course, speed).normalised(0, 90).expanded(domain)
    joint.evaluate([[0, 0, 0]])
    plane = domain.subdomain("course,speed")
    reflected = reflect(plane, _slant, uniform_amount=20, smart_amount=2)
    encode(reflected)
    from_table(domain.subdomain("speed"), [float(v * v) for v in domain["speed"].values()], (2,))
    joint.table()
    functions = [joint, zaic_leq(domain, "depth", 20, 5), constant(domain.subdomain("speed"), 5.0)]
    methods: tuple[Method, ...] = ("sweep", "search")
    for method in methods:
        solve(domain, functions, method=method)
    _warm = True
