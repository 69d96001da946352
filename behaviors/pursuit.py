"""The utility of closing in on a moving point, for CutRange and Trail (behaviors.md C10, C11)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from behaviors import _kernels
from ivp_helm.ivp import Domain, IvPFunction, from_table
from pymoos_lite.geometry.cpa import CpaEngine, unit_vectors

Array = NDArray[np.float64]


def pursuit_utilities(plane: Domain, engine: CpaEngine, horizon: float, patience: float) -> Array | None:
    """For every course and speed of the plane 0 to 100 and somewhat beyond; None when there already.

    `engine` has the point pursued as its contact. `patience` 1 wants the smallest closest approach within
    `horizon` seconds, 0 the highest rate of closure, anything between a mixture.
    """
    if engine.range == 0.0:
        return None
    speeds = plane["speed"].values()
    east, north = unit_vectors(plane["course"].values())
    slowest, fastest = engine.min_max_roc(float(speeds[-1]))
    table = np.empty(plane.points)
    own = (engine.osx - engine.cnx, engine.osy - engine.cny)
    velocity = engine.contact_velocity
    _kernels.pursuit(*own, *velocity, east, north, speeds, horizon, patience, slowest, fastest, table)
    return table


def pursuit_function(plane: Domain, engine: CpaEngine, horizon: float, patience: float) -> IvPFunction | None:
    """`pursuit_utilities` as a function from 0 to 100."""
    table = pursuit_utilities(plane, engine, horizon, patience)
    return None if table is None else from_table(plane, table, tolerance=0.1)
