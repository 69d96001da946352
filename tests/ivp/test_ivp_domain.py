"""Domains: text forms, snapping, parts and unions; and boxes over them."""

from __future__ import annotations

import copy
import json
import math
import pickle
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ivp_helm.ivp import (
    Domain,
    IvPError,
    Variable,
    parse_entry,
    parse_point_box,
    parse_region_box,
    uniform_piece,
)
from ivp_helm.ivp import testing as ivp

DATA = Path(__file__).parents[1] / "data" / "ivp"
CASES = json.loads((DATA / "domain.json").read_text())["cases"]
HELM = Domain.parse("course,0,359,360:speed,0,4,21")


def of_kind(kind: str) -> list[dict[str, Any]]:
    return [c for c in CASES if c["kind"] == kind]


# What the reference takes and we do not, or reads otherwise (ivp_math.md 1.1 and 1.2).
REFUSED = {"speed,a,4,21"}
TRIMMED = {"speed , 0 , 4 , 21": "speed,0,4,21"}


@pytest.mark.parametrize("case", of_kind("parse"), ids=lambda c: c["string"])
def test_a_domain_string_is_read_or_refused_as_measured(case: dict[str, Any]) -> None:
    text, result = case["string"], case["result"]
    if result["size"] == 0 or text in REFUSED:
        with pytest.raises(IvPError):
            Domain.parse(text)
    else:
        assert str(Domain.parse(text)) == TRIMMED.get(text, result["domain"])


@pytest.mark.parametrize("case", of_kind("snap"), ids=lambda c: c["domain"])
def test_values_snap_as_measured_but_for_quotients_that_are_whole(case: dict[str, Any]) -> None:
    v = Domain.parse(case["domain"]).variables[case["var_index"]]
    for row in case["rows"]:
        given_, floor, ceil, near, v_floor, v_ceil, v_near, lower, higher, lower_wrap, higher_wrap = row
        quotient = (given_ - v.low) / v.delta
        if abs(quotient - round(quotient)) > 1e-9:  # else the reference may be one off
            assert (v.index(given_, "floor"), v.index(given_, "ceil")) == (floor, ceil)
            assert v.snap(given_, "floor") == pytest.approx(v_floor)
            assert v.snap(given_, "ceil") == pytest.approx(v_ceil)
        else:
            expected = min(max(round(quotient), 0), v.points - 1)
            assert v.index(given_, "floor") == v.index(given_, "ceil") == expected
        if abs(quotient % 1 - 0.5) > 1e-9:
            assert v.index(given_) == near
            assert v.snap(given_) == pytest.approx(v_near)
            assert v.next_lower(given_) == pytest.approx(lower)
            assert v.next_higher(given_) == pytest.approx(higher)
            assert v.next_lower(given_, wrap=True) == pytest.approx(lower_wrap)
            assert v.next_higher(given_, wrap=True) == pytest.approx(higher_wrap)


@pytest.mark.parametrize("case", of_kind("uniform_piece_for_amount"), ids=lambda c: c["domain"])
def test_a_piece_budget_gives_the_measured_edges(case: dict[str, Any]) -> None:
    domain = Domain.parse(case["domain"])
    for amount, *edges in case["rows"]:
        assert list(uniform_piece(domain, amount)) == edges


@pytest.mark.parametrize("case", of_kind("point_box"), ids=lambda c: c["string"])
def test_point_boxes_are_read_as_measured(case: dict[str, Any]) -> None:
    domain = Domain.parse(case["domain"])
    if not case["index"] or -1 in case["index"]:  # an edge of no length is a fault of the reference
        with pytest.raises(IvPError):
            parse_point_box(domain, case["string"])
    else:
        assert [edge - 1 for edge in parse_point_box(domain, case["string"])] == case["index"]


@pytest.mark.parametrize("case", of_kind("region_box"), ids=lambda c: c["string"])
def test_region_boxes_are_read_as_measured(case: dict[str, Any]) -> None:
    domain = Domain.parse(case["domain"])
    if not case["index"] or "crash" in case["index"]:
        with pytest.raises(IvPError):
            parse_region_box(domain, case["string"])
    else:
        region = parse_region_box(domain, case["string"])
        assert [list(pair) for pair in zip(region.low, region.high, strict=True)] == case["index"]


def test_discrete_all_is_the_full_range() -> None:
    assert parse_region_box(HELM, "discrete @ course:all,speed:2:5").high == (359, 5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "0 field|1 field"),
        ("speed,0,4", "3 field"),
        ("speed,4,0,21", "low 4 is above high 0"),
        ("speed,0,4,1", "do not fit"),
        ("speed,2,2,5", "do not fit"),
        ("speed,0,4,-3", "number of points"),
        ("speed,0,4,1e12", "more than"),
        ("speed,0,nan,5", "not a number"),
        ("speed,0,inf,5", "not a number"),
        (",0,4,5", "name"),
        ("a b,0,4,5", "name"),
        ("x,0,1,2:x,0,1,2", "given twice"),
        ("x,0,1,2::y,0,1,2", "field"),
    ],
)
def test_a_bad_domain_is_refused_with_its_part_named(text: str, words: str) -> None:
    with pytest.raises(IvPError, match=words):
        Domain.parse(text)


class TestEntries:
    def test_commas_and_colons_separate_alike(self) -> None:
        assert parse_entry("course:0:359:360") == parse_entry("course, 0, 359, 360")
        assert Domain.from_entries(["course:0:359:360", "speed:0:4:21"]) is HELM

    def test_a_step_gives_the_count(self) -> None:
        assert parse_entry("speed:0:4:delta=0.2").variable.points == 21
        assert parse_entry("speed:0:4:delta=0.3").variable.points == 14
        assert parse_entry("speed:0:0.3:delta=0.1").variable.points == 4  # 0.3 / 0.1 is 2.999...

    def test_optional_is_marked(self) -> None:
        assert parse_entry("depth:0:100:101:Optional").optional
        assert not parse_entry("depth:0:100:101").optional

    @pytest.mark.parametrize(
        "text",
        [
            *("x:0:4", "x:0:4:5:maybe", "x:0:4:delta=0", "x:0:4:delta=9", "x:0:4:step=1", "x:4:0:5"),
            *("x:0:0:5", "x:0:4:delta=1e-300", "x:a:4:5", "x:0:4:delta=nan"),
        ],
    )
    def test_a_bad_entry_is_refused(self, text: str) -> None:
        with pytest.raises(IvPError):
            parse_entry(text)


class TestParts:
    def test_equal_domains_are_one_object_also_after_pickling(self) -> None:
        again = Domain([Variable("course", 0, 359, 360), Variable("speed", 0.0, 4.0, 21)])
        assert again is HELM
        assert pickle.loads(pickle.dumps(HELM)) is HELM
        assert copy.deepcopy(HELM) is HELM

    def test_a_subdomain_has_the_order_of_the_list(self) -> None:
        assert HELM.subdomain("speed, course").names == ("speed", "course")
        assert HELM.subdomain(["speed"]) is Domain.parse("speed,0,4,21")
        with pytest.raises(IvPError, match="'sped' not in domain; did you mean 'speed'"):
            HELM.subdomain("sped")

    def test_a_union_keeps_the_first_order_and_wants_shared_variables_equal(self) -> None:
        depth = Domain.parse("depth,0,9,10:speed,0,4,21")
        assert HELM.union(depth).names == ("course", "speed", "depth")
        with pytest.raises(IvPError, match="'speed' is speed,0,4,21 in one domain and speed,0,4,41"):
            HELM.union(Domain.parse("speed,0,4,41"))
        with pytest.raises(IvPError, match="no variable"):
            Domain([])

    def test_names_are_compared(self) -> None:
        assert HELM.has_only("speed", "course")
        assert not HELM.has_only("course")
        assert HELM.intersects(Domain.parse("speed,0,9,10"))
        assert not HELM.intersects(Domain.parse("depth,0,9,10"))
        assert HELM.names_text() == "course:speed"

    def test_points_are_translated_both_ways(self) -> None:
        assert HELM.index_of((90.4, 1.31)) == (90, 7)
        assert HELM.value_of((90, 7)) == (90.0, pytest.approx(1.4))
        for bad in ((1.0,), (1.0, 2.0, 3.0)):
            with pytest.raises(IvPError, match="2 values"):
                HELM.index_of(bad)
        with pytest.raises(IvPError, match="no index 21"):
            HELM.value_of((0, 21))
        with pytest.raises(IvPError, match="NaN"):
            HELM.index_of((math.nan, 0.0))


@given(ivp.domains())
def test_a_domain_string_reads_back_as_the_same_domain(domain: Domain) -> None:
    assert Domain.parse(str(domain)) is domain
    assert Domain.parse(str(domain).replace(",", ";"), separator=";") is domain


@given(ivp.domains(max_variables=1), st.floats(-10, 50, allow_nan=False))
def test_the_nearest_index_is_nearest_and_floor_and_ceil_enclose(domain: Domain, value: float) -> None:
    v = domain.variables[0]
    distances = [abs(x - value) for x in v.values()]
    assert distances[v.index(value)] == pytest.approx(min(distances), abs=1e-9)
    floor, ceil = v.index(value, "floor"), v.index(value, "ceil")
    assert floor <= v.index(value) <= ceil or ceil == floor
    assert ceil - floor <= 1


@given(ivp.domains(), st.integers(1, 3000))
def test_equal_pieces_stay_within_their_budget(domain: Domain, amount: int) -> None:
    edges = uniform_piece(domain, amount)
    assert math.prod(-(-p // e) for p, e in zip(domain.points, edges, strict=True)) <= amount
