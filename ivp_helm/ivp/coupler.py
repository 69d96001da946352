"""Joining functions over separate variables into one function over all of them.

Source: ivp_math.md 5.
"""

from __future__ import annotations

import math

from ivp_helm.ivp import kernels
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction


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


_joints: dict[tuple[Domain, Domain], Domain] = {}


def _joint_domain(first: Domain, second: Domain) -> Domain:
    """The union, remembered: making a domain costs more than coupling."""
    found = _joints.get((first, second))
    if found is None:
        if len(_joints) > 256:
            _joints.clear()
        found = _joints[first, second] = first.union(second)
    return found
