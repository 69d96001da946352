"""The reflector: no worse than the reference on its own functions, exact where possible, and repeatable."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import (
    Build,
    Domain,
    IvPError,
    Region,
    fit_kernels,
    join_build_info,
    parse_build_info,
    rate,
    reflect,
    reflector,
    tabulate,
)
from ivp_helm.ivp import testing as ivp

DATA = Path(__file__).parents[1] / "data" / "ivp"
CASES = json.loads((DATA / "reflector.json").read_text())["cases"]
HELM = Domain.parse("course,0,359,360:speed,0,4,21")
PLANE = Domain.parse("x,-50,50,101:y,-50,50,101")
Array = Any


def mgauss(parts: list[str]) -> Callable[..., Array]:
    components = [[float(x) for x in part.split("=")[1].split(":")] for part in parts]

    def f(*v: Array) -> Array:
        total = np.zeros_like(v[0])
        for height, sigma, *centre in components:
            total += height * np.exp(
                -sum((x - c) ** 2 for x, c in zip(v, centre, strict=True)) / (2 * sigma**2)
            )
        return total

    return f


def closest_approach(p: dict[str, float]) -> Callable[..., Array]:
    def f(course: Array, speed: Array) -> Array:
        vx = p["cnv"] * np.sin(np.radians(p["cnh"])) - speed * np.sin(np.radians(course))
        vy = p["cnv"] * np.cos(np.radians(p["cnh"])) - speed * np.cos(np.radians(course))
        vv = vx**2 + vy**2
        moving = vv > 0
        t = np.where(moving, -(p["cnx"] * vx + p["cny"] * vy) / np.where(moving, vv, 1.0), 0.0)
        t = np.clip(t, 0, p["tol"])
        d = np.hypot(p["cnx"] + vx * t, p["cny"] + vy * t)
        return np.clip(100 * (d - p["dmin"]) / (p["dmax"] - p["dmin"]), 0, 100)

    return f


def underlying(definition: str) -> Callable[..., Array]:
    """The closed forms of the golden file's `functions`."""
    kind, *parts = definition.split()
    if kind == "mgauss":
        return mgauss(parts)
    p = {k: float(v) for k, v in (part.split("=") for part in parts)}
    if kind == "quadratic":
        return lambda *v: p.get("b", 0) + sum(p[f"m{i}"] * (x - p[f"c{i}"]) ** 2 for i, x in enumerate(v))
    if kind == "linear":
        return lambda *v: p.get("b", 0) + sum(p[f"m{i}"] * x for i, x in enumerate(v))
    if kind == "cone":
        return lambda *v: np.maximum(
            0, 100 * (1 - np.sqrt(sum(((x - p[f"c{i}"]) / p[f"w{i}"]) ** 2 for i, x in enumerate(v))))
        )
    if kind == "cosspeed":
        return lambda course, speed: speed * np.cos(np.radians(course - p["brg"]))
    assert kind == "cpalike"
    return closest_approach(p)


@pytest.mark.parametrize("case", CASES, ids=lambda c: c["id"])
def test_a_built_function_is_no_worse_than_the_measured_one(case: dict[str, Any]) -> None:
    domain, result = Domain.parse(case["domain"]), case["result"]
    function = underlying(case["definition"])
    options = case.get("create_args") or {}

    def build() -> Any:
        text = case.get("params", "")
        return reflect(domain, function, text, degree=case["degree"], normalise=False, **options)

    if not result["built"]:
        with pytest.raises(IvPError, match=result["warnings"].split(":")[0].split(" value")[0]):
            build()
        return
    f = build()
    assert f.coverage() == (0, 0)
    rating, measured = rate(function, f), result["err"]
    if case["random_queue"]:  # the reference drops pieces at random; ours spends the whole budget
        assert rating.mean <= 1.1 * measured["mean"] + 1e-9
    else:
        assert f.pieces <= result["count"]
        assert rating.mean <= measured["mean"] + 1e-9
        assert rating.worst <= measured["max"] + 1e-9


def bowl(x: Array, y: Array) -> Array:
    return 100 - 0.02 * (x - 12) ** 2 - 0.03 * (y + 20) ** 2


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-50, 50), st.integers(1, 400), st.booleans())
@settings(max_examples=30, deadline=None)
def test_a_plane_is_reproduced_exactly(a: float, b: float, c: float, amount: int, strict: bool) -> None:
    def plane(x: Array, y: Array) -> Array:
        return a * x + b * y + c

    f = reflect(PLANE, plane, uniform_amount=amount, strict_range=strict, normalise=False)
    assert rate(plane, f).worst <= 1e-9 * (1 + abs(a) + abs(b) + abs(c)) * 100


@given(ivp.domains(max_variables=3), st.integers(0, 2**31), st.integers(0, 60), st.integers(0, 1))
@settings(max_examples=60, deadline=None)
def test_every_point_is_covered_once_within_the_range_of_the_samples(
    domain: Domain, seed: int, smart: int, degree: int
) -> None:
    values = np.random.default_rng(seed).uniform(-20, 30, domain.points)

    def rough(*native: Array) -> Array:
        at = [
            np.rint((x - v.low) / (v.delta or 1)).astype(int)
            for x, v in zip(native, domain.variables, strict=True)
        ]
        return values[tuple(at)]

    f = reflect(domain, rough, uniform_amount=9, smart_amount=smart, degree=degree, normalise=False)
    assert f.coverage() == (0, 0)
    assert f.pieces <= 9 + smart
    if degree == 0:
        ivp.check_function(f, values.min(), values.max())


def test_the_error_falls_as_pieces_grow_in_number() -> None:
    errors = [
        rate(bowl, reflect(PLANE, bowl, uniform_amount=n, normalise=False)).mean
        for n in (1, 9, 100, 676, 2601)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < errors[0] / 500
    smart = [
        rate(bowl, reflect(PLANE, bowl, uniform_amount=9, smart_amount=n, normalise=False)).mean
        for n in (0, 20, 200)
    ]
    assert smart == sorted(smart, reverse=True)


def test_pieces_of_single_points_are_exact() -> None:
    domain = Domain.parse("x,-5,5,11:y,-5,5,11")
    f = reflect(domain, bowl, uniform_amount=121, normalise=False)
    np.testing.assert_allclose(f.table(), tabulate(domain, bowl), rtol=1e-12)


def test_a_result_is_stretched_to_a_hundred_unless_told_otherwise() -> None:
    f = reflect(PLANE, bowl, uniform_amount=100)
    assert (f.minimum, f.maximum) == (0.0, 100.0)
    ivp.check_function(f)


def test_the_queue_for_large_domains_makes_the_same_pieces_as_the_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def peaks(x: Array, y: Array) -> Array:
        return mgauss(["c=100:9:10:-15", "c=60:8:-30:25"])(x, y)

    small = reflect(PLANE, peaks, uniform_amount=25, smart_amount=333, normalise=False)
    monkeypatch.setattr(reflector, "TABLE_POINTS", 0)
    large = reflect(PLANE, peaks, uniform_amount=25, smart_amount=333, normalise=False)
    np.testing.assert_array_equal(small.low, large.low)
    np.testing.assert_array_equal(small.high, large.high)
    np.testing.assert_allclose(small.coefficients, large.coefficients, rtol=1e-12, atol=1e-12)


def test_the_queue_stops_at_its_threshold_and_when_every_piece_is_exact() -> None:
    f = reflect(PLANE, bowl, uniform_amount=100, smart_amount=5000, smart_thresh=0.05, normalise=False)
    assert 100 < f.pieces < 2000
    tiny = Domain.parse("x,0,3,4:y,0,3,4")
    f = reflect(tiny, bowl, smart_amount=999, normalise=False)
    assert f.pieces <= 16
    np.testing.assert_allclose(f.table(), tabulate(tiny, bowl), rtol=1e-12)


def test_auto_peak_isolates_the_highest_point() -> None:
    f = reflect(PLANE, bowl, uniform_amount=25, auto_peak=True, normalise=False)
    top = np.unravel_index(np.argmax(f.table()), PLANE.points)
    alone = (f.low == f.high).all(axis=1)
    assert list(top) in f.low[alone].tolist()
    assert f.maximum == pytest.approx(bowl(*PLANE.value_of([int(i) for i in top])))
    assert reflect(PLANE, bowl, uniform_amount=25, auto_peak=True, auto_peak_max=2).pieces == 27


class TestRegions:
    PLATEAU = Region((10, 10), (30, 40))
    BASIN = Region((25, 35), (60, 70))

    def test_plateaus_and_basins_become_pieces_with_the_known_values(self) -> None:
        f = reflect(
            PLANE, bowl, uniform_amount=100, plateaus=(self.PLATEAU,), basins=(self.BASIN,),
            known_max=500.0, known_min=-500.0, normalise=False,
        )  # fmt: skip
        assert f.coverage() == (0, 0)
        table = f.table()
        # the region further up is kept whole, the other loses what they share
        assert (table[25:61, 35:71] == -500).all()
        plateau = table[10:31, 10:41].copy()
        assert (plateau[:15] == 500).all()
        assert (plateau[15:, :25] == 500).all()
        assert (table == 500).sum() == 21 * 31 - 6 * 6
        assert table[0, 0] == pytest.approx(bowl(-50.0, -50.0), abs=2.0)

    def test_a_refined_region_is_tiled_by_its_own_pieces(self) -> None:
        text = "uniform_amount=50 # refine_region=native@x:0:20,y:-30:0 # refine_piece=discrete@x:2,y:2"
        f = reflect(PLANE, bowl, text, normalise=False)
        inside = ((f.low >= [50, 20]) & (f.high <= [70, 50])).all(axis=1)
        assert inside.sum() == 11 * 16
        assert (f.high - f.low)[inside].max() <= 1
        assert f.grid == (15, 15)  # kept, where the reference falls back to the whole domain

    def test_a_region_outside_the_domain_is_refused(self) -> None:
        with pytest.raises(IvPError, match="expected 0 <= low <= high <= 100"):
            reflect(PLANE, bowl, plateaus=(Region((90, 0), (101, 5)),))


class TestUnderlyingFunctions:
    def test_a_compiled_function_serves_as_well(self) -> None:
        import numba

        compiled = numba.vectorize(["float64(float64, float64)"])(
            lambda x, y: 100 - 0.02 * x * x - 0.03 * y * y
        )
        f = reflect(PLANE, compiled, uniform_amount=100)
        g = reflect(PLANE, lambda x, y: 100 - 0.02 * x * x - 0.03 * y * y, uniform_amount=100)
        np.testing.assert_allclose(f.table(), g.table(), atol=1e-9)

    def test_a_constant_is_spread_over_all_points(self) -> None:
        f = reflect(PLANE, lambda x, y: 7.0, uniform_amount=9, normalise=False)
        assert (f.table() == 7.0).all()

    def test_a_function_that_changes_its_arguments_does_no_harm(self) -> None:
        def rude(x: Array, y: Array) -> Array:
            x -= 12
            y += 20
            return 100 - 0.02 * x**2 - 0.03 * y**2

        for _ in range(2):
            f = reflect(PLANE, rude, uniform_amount=100, normalise=False)
            assert rate(bowl, f).worst < 1.3

    @pytest.mark.parametrize(
        ("function", "words"),
        [
            (lambda x, y: np.zeros(3), r"shape \(3,\)"),
            (lambda x, y: np.where(x > 0, np.nan, 1.0), "not finite"),
            (lambda x, y: np.where(x > 0, np.inf, 1.0), "not finite"),
        ],
    )
    def test_bad_values_are_refused(self, function: Any, words: str) -> None:
        with pytest.raises(IvPError, match=words):
            reflect(PLANE, function, uniform_amount=9)


class TestBuildInfo:
    def test_the_users_text_wins_over_the_defaults(self) -> None:
        text = join_build_info(["uniform_amount=600 # smart_amount=500", "uniform_amount = 20"])
        build = parse_build_info(HELM, text)
        assert (build.uniform_amount, build.smart_amount) == (20, 500)

    def test_clear_forgets_what_was_before(self) -> None:
        text = join_build_info(["uniform_amount=600 # smart_amount=500", "clear", "smart_amount=3"])
        assert text == "smart_amount=3"
        assert parse_build_info(HELM, "smart_amount=9 # clear # uniform_amt=4") == Build(uniform_amount=4)

    def test_every_parameter_is_read(self) -> None:
        build = parse_build_info(
            HELM,
            "UNIFORM_BOX = discrete @ course:3,speed:3 # uniform_grid=discrete@course:9,speed:6"
            "# smart_percent=20"
            "# smart_thresh=0.5 # priority_amt=7 # auto_peak=true # auto_peak_max_pcs=11 # strict_range=false"
            "# focus_region=native@course:0:90,speed:all # focus_box=discrete@course:2,speed:2"
            "# plateau_region=discrete@course:0:3,speed:0:3 # basin_region=discrete@course:9:9,speed:all",
        )
        assert build == Build(
            uniform_piece=(3, 3), uniform_grid=(9, 6), smart_percent=20, smart_thresh=0.5, smart_amount=7,
            auto_peak=True, auto_peak_max=11, strict_range=False,
            refine_regions=(Region((0, 0), (90, 20)),), refine_pieces=((2, 2),),
            plateaus=(Region((0, 0), (3, 3)),), basins=(Region((9, 0), (9, 20)),),
        )  # fmt: skip
        assert parse_build_info(HELM, "refine_clear=1", build).refine_pieces == ()

    def test_what_has_no_effect_is_noted(self) -> None:
        notes: list[str] = []
        text = "uniform_amount 5 # queue_levels=9 # refine_piece=discrete@course:2,speed:2"
        assert parse_build_info(HELM, text, notes=notes).uniform_amount == 1
        assert [n.split(":")[1].split()[0] for n in notes] == ["'uniform_amount", "queue_levels", "0"]

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("precision=high", "precision: unhandled parameter"),
            ("uniform_ammount=3", "did you mean 'uniform_amount'"),
            ("uniform_amount=0", "uniform_amount value must be >= 1"),
            ("smart_amount=-1", "smart_amount value must be >= 0"),
            ("smart_thresh=x", "smart_thresh value must be >= 0"),
            ("smart_thresh=nan", "smart_thresh value must be >= 0"),
            ("auto_peak=yes", "auto_peak value must be true/false"),
            ("uniform_piece=discrete@course:3", "'speed' is missing"),
            ("refine_region=course:0:9,speed:0:1", "expected 'native @"),
            ("queue_levels=0", "queue_levels value must be >= 1"),
        ],
    )
    def test_a_bad_text_is_refused(self, text: str, words: str) -> None:
        with pytest.raises(IvPError, match=words):
            parse_build_info(HELM, text)

    def test_bad_options_are_refused(self) -> None:
        for options, words in (
            ({"uniform_pieces": 3}, "unknown option"),
            ({"uniform_piece": (3,)}, "does not fit"),
            ({"degree": 2}, "degree 2"),
        ):
            with pytest.raises(IvPError, match=words):
                reflect(PLANE, bowl, **options)  # type: ignore[arg-type]
        with pytest.raises(IvPError, match="more than 5000000"):
            reflect(Domain.parse("x,0,9999,10000:y,0,9999,10000"), bowl, uniform_piece=(1, 1))


def obvious_fit(low: Any, high: Any, values: Any, degree: int, strict: bool) -> tuple[list[float], float]:
    """The regression of ivp_math.md 6.4, sentence by sentence; `values` is a table over all points."""
    dims = len(low)
    corners = [tuple(high[d] if (c >> d) & 1 else low[d] for d in range(dims)) for c in range(2**dims)]
    samples = list(corners)
    if any(b - a >= 2 for a, b in zip(low, high, strict=True)):
        samples.append(tuple(a + (b - a) // 2 for a, b in zip(low, high, strict=True)))
    f = [float(values[s]) for s in samples]
    if degree == 0:
        mean = sum(f) / len(f)
        return [0.0] * dims + [mean], sum((x - mean) ** 2 for x in f[: len(corners)]) ** 0.5
    slopes = []
    for d in range(dims):
        rises = [
            f[corners.index((*c[:d], high[d], *c[d + 1 :]))] - f[i]
            for i, c in enumerate(corners)
            if not (i >> d) & 1
        ]
        slopes.append(0.0 if low[d] == high[d] else sum(rises) / len(rises) / (high[d] - low[d]))
    plane = [sum(s * x for s, x in zip(slopes, sample, strict=True)) for sample in samples]
    intercept = sum(x - p for x, p in zip(f, plane, strict=True)) / len(f)
    if strict:
        intercept = min(intercept, *(max(f) - p for p in plane))
        intercept = max(intercept, *(min(f) - p for p in plane))
    residuals = [x - p - intercept for x, p in zip(f, plane, strict=True)]
    return [*slopes, intercept], sum(r * r for r in residuals) ** 0.5 / len(f)


@given(ivp.domains(max_variables=3), st.integers(0, 2**31), st.integers(0, 1), st.booleans())
@settings(max_examples=80, deadline=None)
def test_the_fit_of_one_piece_is_the_written_one(
    domain: Domain, seed: int, degree: int, strict: bool
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.uniform(-9, 20, domain.points)
    low = np.array([rng.integers(0, p) for p in domain.points])
    high = np.array([rng.integers(a, p) for a, p in zip(low, domain.points, strict=True)])
    box = fit_kernels.sample_points(low[None], high[None], np.zeros(len(domain)), np.ones(len(domain)))
    sampled = values[tuple(box.astype(int))]
    coef = np.empty(len(domain) + 1)
    error = fit_kernels.fit(low, high, sampled, degree, strict, coef)
    # a corner that stands for two (an edge of one point) is sampled twice, as the reference counts it
    expected, expected_error = obvious_fit(low.tolist(), high.tolist(), values, degree, strict)
    if (high > low).all():
        np.testing.assert_allclose(coef, expected, rtol=1e-9, atol=1e-9)
        assert error == pytest.approx(expected_error, rel=1e-9, abs=1e-9)
    assert fit_kernels.fit.py_func(low, high, sampled, degree, strict, coef) == pytest.approx(
        error, abs=1e-12
    )
