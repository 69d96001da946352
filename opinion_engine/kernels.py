"""The equation of opinion dynamics as compiled functions over plain arrays.

One agent with its neighbours held, which is what a boat computes; `network_kernels` has dense networks and
`population_kernels` large sparse ones. Nothing here knows names, messages, clocks or random numbers. Every
function is compiled without fast-math and uses its own `tanh`, so that the same inputs give the same bits on
every machine, for every number of threads, and inside or outside a vectorised loop.

Sections cited as "gcid.md n"; paper equations are those of Paine & Benjamin.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from opinion_engine.intrinsics import bits_of, double_of, multiply_add

MAX_SUBSTEPS = 200
"""Most Runge-Kutta sub-steps in one update (gcid.md 4)."""

_SATURATED = 20.0  # tanh(20) is 1 to the last bit of a double
_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding it rounds to an integer kept in the low bits
_LOG2_E = 1.4426950408889634
_LN2_HIGH = 6.93147180369123816490e-01  # ln 2 in two parts, so that k * high is exact for the k that occur
_LN2_LOW = 1.90821492927058770002e-10

# (exp(r) - 1 - r) / r^2 for |r| <= ln(2)/2 within 1.1e-16: interpolated at Chebyshev points in 60 digits.
_C0, _C1, _C2 = 0.5000000000000001, 0.16666666666666669, 0.04166666666662399
_C3, _C4, _C5 = 0.008333333333330051, 0.0013888888917281794, 0.00019841269863105968
_C6, _C7, _C8 = 2.480152119021773e-05, 2.7557268378684192e-06, 2.7620138719733994e-07
_C9 = 2.5100424157005067e-08


@njit(cache=True, error_model="numpy")
def _growth(x: float) -> float:
    """exp(2 |x|) - 1 with full relative accuracy near 0; |x| beyond 20 counts as 20. Free of branches."""
    magnitude = abs(x)
    t = 2.0 * (_SATURATED if magnitude > _SATURATED else magnitude)
    shifted = multiply_add(t, _LOG2_E, _ROUND)
    k = shifted - _ROUND
    r = multiply_add(k, -_LN2_LOW, multiply_add(k, -_LN2_HIGH, t))  # |r| <= ln(2)/2
    r2 = r * r
    r4 = r2 * r2
    low = multiply_add(r2, multiply_add(r, _C3, _C2), multiply_add(r, _C1, _C0))
    middle = multiply_add(r2, multiply_add(r, _C7, _C6), multiply_add(r, _C5, _C4))
    high = multiply_add(r, _C9, _C8)
    expm1_r = multiply_add(r2, multiply_add(r4, multiply_add(r4, high, middle), low), r)
    scale = double_of((bits_of(shifted) + 1023) << 52)  # 2**k
    return multiply_add(scale, expm1_r, scale - 1.0)


@njit(cache=True, error_model="numpy")
def tanh(x: float) -> float:
    """Hyperbolic tangent, exactly odd, within 2 units in the last place, NaN for NaN.

    tanh t = e / (e + 2) with e = exp(2t) - 1 keeps full relative accuracy near 0. The library's tanh would be
    as good, but differs between platforms and is not vectorised by the compiler; this one is branch-free.
    """
    e = _growth(x)
    value: float = np.copysign(e / (e + 2.0), x)
    return value


@njit(cache=True, error_model="numpy")
def tanh_difference(x: float, y: float) -> float:
    """tanh x - tanh y within 4e-16, with one division for both."""
    e, g = _growth(x), _growth(y)
    below_x, below_y = e + 2.0, g + 2.0
    return (np.copysign(e, x) * below_y - np.copysign(g, y) * below_x) / (below_x * below_y)


@njit(cache=True, error_model="numpy")
def tanh_array(x: np.ndarray, out: np.ndarray) -> None:
    """`tanh` of every element of the one-dimensional `x` into `out`."""
    for i in range(x.size):
        out[i] = tanh(x[i])


@njit(cache=True, error_model="numpy")
def power(base: float, exponent: float) -> Any:
    """base ** exponent for base >= 0; small whole exponents by multiplication, 0 ** n = 0."""
    if exponent == 2.0:
        return base * base
    if exponent == 3.0:
        return base * base * base
    if exponent == 1.0:
        return base
    if exponent == 4.0:
        return (base * base) * (base * base)
    return base**exponent


@njit(cache=True, error_model="numpy")
def hill(y: float, u_min: float, u_max: float, y_th: float, n: float) -> Any:
    """S_u(y) = u_min + (u_max - u_min) y^n / (y_th^n + y^n), written so that no power overflows."""
    ratio = y / y_th
    if ratio <= 1.0:
        p = power(ratio, n)
        return u_min + (u_max - u_min) * (p / (1.0 + p))
    p = power(1.0 / ratio, n)
    return u_min + (u_max - u_min) / (1.0 + p)


# --------------------------------------------------------------------------------------------- one agent


@njit(cache=True, error_model="numpy")
def hear(
    now: float,
    stale: float,
    count: int,
    record_time: np.ndarray,
    record_z: np.ndarray,
    record_square: np.ndarray,
    heard_sum: np.ndarray,
) -> float:
    """Sum the fresh neighbours' opinions into `heard_sum` (N_O); return the sum of their mean squares.

    A record counts while now - time <= stale (gcid.md 7). record_z is (K, N_O), of which `count` rows are in
    use.
    """
    n_o = heard_sum.size
    for j in range(n_o):
        heard_sum[j] = 0.0
    square = 0.0
    for k in range(count):
        if now - record_time[k] <= stale:
            for j in range(n_o):
                heard_sum[j] += record_z[k, j]
            square += record_square[k]
    return square


@njit(cache=True, error_model="numpy")
def project_active(z: np.ndarray, active: np.ndarray) -> None:
    """Zero the inactive opinions and subtract the mean of the active ones, in place."""
    total = 0.0
    n = 0
    for j in range(z.size):
        if active[j]:
            total += z[j]
            n += 1
        else:
            z[j] = 0.0
    if n > 0:
        mean = total / n
        for j in range(z.size):
            if active[j]:
                z[j] -= mean


@njit(cache=True, error_model="numpy")
def substeps(dt: float, rate: float) -> int:
    """Equal Runge-Kutta steps an update of dt needs: rate * step <= 0.2, within [1, MAX_SUBSTEPS]."""
    m = np.ceil(dt * rate / 0.2)
    if not m >= 1.0:
        return 1
    return MAX_SUBSTEPS if m > MAX_SUBSTEPS else int(m)


@njit(cache=True, error_model="numpy")
def _agent_rate(
    z: np.ndarray,
    u: float,
    resistance: np.ndarray,
    b: np.ndarray,
    active: np.ndarray,
    n_active: int,
    constant: np.ndarray,
    pairs: int,
    row_of: np.ndarray,
    column_of: np.ndarray,
    slope: np.ndarray,
    offset: np.ndarray,
    argument: np.ndarray,
    rate: np.ndarray,
) -> float:
    """Projected z' of one agent into `rate` (0 where inactive); returns its own mean square."""
    square = 0.0
    for j in range(z.size):
        rate[j] = constant[j]
        square += z[j] * z[j]  # inactive ones are 0
    for p in range(pairs):
        argument[p] = slope[p] * z[column_of[p]] + offset[p]
    for p in range(pairs):
        argument[p] = tanh(argument[p])
    for p in range(pairs):
        rate[row_of[p]] += argument[p]
    mean = 0.0
    for j in range(z.size):
        if active[j]:
            rate[j] = u * rate[j] - resistance[j] * z[j] + b[j]
            mean += rate[j]
    mean /= n_active
    for j in range(z.size):
        if active[j]:
            rate[j] -= mean
    return square / n_active


@njit(cache=True, error_model="numpy")
def agent_step(
    z: np.ndarray,
    u: float,
    dt: float,
    resistance: np.ndarray,
    own: np.ndarray,
    heard: np.ndarray,
    heard_sum: np.ndarray,
    heard_square: float,
    b: np.ndarray,
    active: np.ndarray,
    tau_u: float,
    u_min: float,
    u_max: float,
    y_th: float,
    n: float,
) -> float:
    """Integrate one agent's opinions (in place) and attention (returned) over dt by equal classical RK4
    steps.

    Paper equations (2) and (5) with inputs and neighbours held: z (N_O), own[j, l] = A_ii^jl, heard[j, l] =
    A_ik^jl for every neighbour, heard_sum the sum of the neighbours' opinions, heard_square the sum of their
    mean squares. Options that are not active have no row and no term.

    The step follows gcid.md 4 in spirit, rate * step <= 0.2, with the rates of the system that is integrated:
    the agent's own couplings (held neighbours shift the argument of tanh but add no rate), attention's
    1/tau_u, and the speed at which the arguments of tanh move at the start, without which a large new input
    would jump over the bend of tanh in one step.
    """
    n_o = z.size
    project_active(z, active)
    # Gather the live pairs. A pair without own coupling saturates a constant, computed once.
    row_of = np.empty(n_o * n_o, np.int64)
    column_of = np.empty(n_o * n_o, np.int64)
    slope = np.empty(n_o * n_o)
    offset = np.empty(n_o * n_o)
    constant = np.zeros(n_o)
    pairs = 0
    n_active = 0
    fastest = 1.0 / tau_u
    for j in range(n_o):
        if not active[j]:
            continue
        n_active += 1
        row_sum = 0.0
        for option in range(n_o):
            if not active[option]:
                continue
            shift = heard[j, option] * heard_sum[option]
            if own[j, option] == 0.0:
                if shift != 0.0:
                    constant[j] += tanh(shift)
            else:
                row_of[pairs] = j
                column_of[pairs] = option
                slope[pairs] = own[j, option]
                offset[pairs] = shift
                row_sum += abs(own[j, option])
                pairs += 1
        fastest = max(fastest, resistance[j] + u_max * row_sum)
    if n_active == 0:
        return u
    argument = np.empty(pairs)
    stage_z = np.empty(n_o)
    rate_z = np.zeros(n_o)
    sum_z = np.empty(n_o)
    _agent_rate(
        z,
        u,
        resistance,
        b,
        active,
        n_active,
        constant,
        pairs,
        row_of,
        column_of,
        slope,
        offset,
        argument,
        rate_z,
    )
    speed = 0.0
    for p in range(pairs):
        speed = max(speed, abs(slope[p] * rate_z[column_of[p]]))
    m = substeps(dt, fastest + speed)
    h = dt / m
    for _ in range(m):
        sum_u = 0.0
        stage_u = u
        for j in range(n_o):
            stage_z[j] = z[j]
            sum_z[j] = 0.0
        for stage in range(4):
            square = _agent_rate(
                stage_z, stage_u, resistance, b, active, n_active, constant, pairs, row_of, column_of, slope,
                offset, argument, rate_z,
            )  # fmt: skip
            rate_u = (hill(square + heard_square, u_min, u_max, y_th, n) - stage_u) / tau_u
            weight = 1.0 if stage == 0 or stage == 3 else 2.0
            ahead = h if stage == 2 else 0.5 * h
            for j in range(n_o):
                sum_z[j] += weight * rate_z[j]
                stage_z[j] = z[j] + ahead * rate_z[j]
            sum_u += weight * rate_u
            stage_u = u + ahead * rate_u
        for j in range(n_o):
            z[j] += (h / 6.0) * sum_z[j]
        u += (h / 6.0) * sum_u
    project_active(z, active)
    return min(max(u, u_min), u_max)  # only round-off can leave the range


@njit(cache=True, error_model="numpy")
def agent_step_reference(
    z: np.ndarray,
    u: float,
    dt: float,
    resistance: np.ndarray,
    own: np.ndarray,
    heard: np.ndarray,
    heard_sum: np.ndarray,
    heard_square: float,
    b: np.ndarray,
    active: np.ndarray,
    tau_u: float,
    u_min: float,
    u_max: float,
    y_th: float,
    n: float,
) -> float:
    """One step exactly as the authors' implementation takes it (gcid.md 2, variant `reference`).

    Explicit Euler, attention first and the new attention in the opinions; cross terms keep what neighbours
    say about an option that is inactive here; the result is centred over all options, inactive ones included.
    """
    n_o = z.size
    n_active = 0
    y = 0.0
    for j in range(n_o):
        if active[j]:
            n_active += 1
            y += z[j] * z[j]
        else:
            z[j] = 0.0
    if n_active == 0:
        return u
    y = y / n_active + heard_square
    u += dt * (hill(y, u_min, u_max, y_th, n) - u) / tau_u
    u = min(max(u, u_min), u_max)
    force = np.zeros(n_o)
    mean = 0.0
    for j in range(n_o):
        if active[j]:
            total = tanh(own[j, j] * z[j] + heard[j, j] * heard_sum[j])
            for option in range(n_o):
                if option != j:
                    total += tanh(own[j, option] * z[option] + heard[j, option] * heard_sum[option])
            force[j] = -resistance[j] * z[j] + b[j] + u * total
            mean += force[j]
    mean /= n_active
    centre = 0.0
    for j in range(n_o):
        if active[j]:
            z[j] += dt * (force[j] - mean)
        centre += z[j]
    centre /= n_o
    for j in range(n_o):
        z[j] -= centre
    return u


@njit(cache=True, error_model="numpy")
def agent_update(
    z: np.ndarray,
    u: float,
    dt: float,
    now: float,
    stale: float,
    count: int,
    record_time: np.ndarray,
    record_z: np.ndarray,
    record_square: np.ndarray,
    heard_sum: np.ndarray,
    resistance: np.ndarray,
    own: np.ndarray,
    heard: np.ndarray,
    b: np.ndarray,
    active: np.ndarray,
    tau_u: float,
    u_min: float,
    u_max: float,
    y_th: float,
    n: float,
    reference: bool,
) -> tuple[float, float]:
    """`hear`, then one update of either variant: (new attention, the neighbours' part of y). z changes in
    place.
    """
    square = hear(now, stale, count, record_time, record_z, record_square, heard_sum)
    if reference:
        u = agent_step_reference(
            z, u, dt, resistance, own, heard, heard_sum, square, b, active, tau_u, u_min, u_max, y_th, n
        )
    else:
        u = agent_step(
            z, u, dt, resistance, own, heard, heard_sum, square, b, active, tau_u, u_min, u_max, y_th, n
        )
    return u, square
