"""Joining functions over separate variables into one function over all of them.

Source: ivp_math.md 5.
"""

from __future__ import annotations

import math

import numpy as np

from ivp_helm.ivp import kernels
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction
from ivp_helm.ivp.zaic import Peak, zaic_peak
from ivp_helm.ivp.zaic_kernels import coupled_peak


def couple(
    first: IvPFunction,
    second: IvPFunction,
    first_weight: float = 50.0,
    second_weight: float = 50.0,
    *,
    limits: tuple[float, float] | None = (0.0, 100.0),
    domain: Domain | None = None,
) -> IvPFunction:
    """h(a, b) = f(a) + g(b): a function over the variables of both, those of `first` before the others.

    Each part is stretched to 0..its weight first, so the weights act as a ratio; a flat part keeps its
    level. The sum is then stretched to `limits`, unless they are None. The pieces are all pairs of the
    parts' pieces; the result has the default priority weight and no context.

    domain    given, the result's variables follow the order of this domain (which must hold them all)

    Raises `IvPError` when the parts share a variable, a weight is not above 0, or limits are reversed.
    """
    shared = set(first.domain.names) & set(second.domain.names)
    if shared:
        raise IvPError(f"cannot couple: both parts are over {sorted(shared)[0]!r}")
    for weight in (first_weight, second_weight):
        if not (weight > 0 and math.isfinite(weight)):
            raise IvPError(f"cannot couple: weight {weight} is not above 0")
    low, high = (0.0, 0.0) if limits is None else (float(limits[0]), float(limits[1]))
    if limits is not None and not (low < high and math.isfinite(low) and math.isfinite(high)):
        raise IvPError(f"cannot couple: limits {limits[0]} to {limits[1]} are not in order")
    joint = _joint_domain(first.domain, second.domain)
    block = kernels.coupled(
        first._without_overlaps(), second._without_overlaps(),
        float(first_weight), float(second_weight), low, high,
    )  # fmt: skip
    h = IvPFunction._of_block(
        joint,
        block,
        first.grid + second.grid,
        degree=max(first.degree, second.degree),
    )
    if domain is not None:
        wanted = domain.subdomain([n for n in domain.names if n in joint])
        if len(wanted) != len(joint):
            missing = next(n for n in joint.names if n not in domain)
            raise IvPError(f"cannot couple: variable {missing!r} not in domain {domain}")
        h = h.expanded(wanted)
    return h


class CoupledPeak:
    """``couple(zaic_peak(domain, variable, peak, wrap=wrap), second, first_weight, second_weight)`` for one
    summit after another: the same function, without a step between.

    `peak` gives everything but the summit. Raises `IvPError` for whatever the two refuse.
    """

    __slots__ = ("_block", "_degree", "_domain", "_fold", "_grid", "_shape", "second")

    def __init__(
        self,
        domain: Domain,
        variable: str,
        peak: Peak,
        second: IvPFunction,
        first_weight: float = 50.0,
        second_weight: float = 50.0,
        *,
        wrap: bool = False,
    ) -> None:
        model = couple(
            zaic_peak(domain, variable, peak, wrap=wrap), second, first_weight, second_weight
        )  # which checks everything
        v = domain[variable]
        drop = min(max(peak.summitdelta, 0.0), peak.maxutil - peak.minutil)
        widths = (max(peak.peakwidth, 0.0), max(peak.basewidth, 0.0), drop, peak.minutil, peak.maxutil)
        place = (v.low, v.high, v.delta, v.points, float(wrap))
        self._shape = np.array((*widths, *place, first_weight, second_weight, 0.0, 100.0))
        circle = v.high - v.low + v.delta
        self._fold = (v.low, circle) if wrap and circle > 0 else None
        self._domain, self._grid, self._degree = model.domain, model.grid, model.degree
        self.second = second
        self._block = second._without_overlaps()

    def at(self, summit: float) -> IvPFunction:
        """The function with the peak at `summit`; raises `IvPError` if that is not finite."""
        if not math.isfinite(summit):
            raise IvPError(f"peak over {self._domain.names[0]!r}: summit {summit} is not a finite number")
        if self._fold is not None:
            low, circle = self._fold
            if not low <= summit < low + circle:
                summit = low + (summit - low) % circle
        block = coupled_peak(float(summit), self._shape, self._block)
        return IvPFunction._of_block(self._domain, block, self._grid, self._degree)


_joints: dict[tuple[Domain, Domain], Domain] = {}


def _joint_domain(first: Domain, second: Domain) -> Domain:
    """The union, remembered: making a domain costs more than coupling."""
    found = _joints.get((first, second))
    if found is None:
        if len(_joints) > 256:
            _joints.clear()
        found = _joints[first, second] = first.union(second)
    return found
