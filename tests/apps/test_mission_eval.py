"""pMissionEval: aspects, flags, macros, report lines."""

import pytest
from app_harness import Harness
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.apps.mission_eval import (
    Aspect,
    Evaluation,
    MissionEval,
    build_aspects,
    expand_macros,
    parse_mail_flag,
)
from pymoos_lite.config.conditions import parse_condition


def evaluate(block: str, **options) -> tuple[Harness, list[str]]:
    written: list[str] = []
    cls = type("Quiet", (MissionEval,), {"APPEND": staticmethod(lambda path, text: written.append(text))})
    return Harness(cls, block, name="pMissionEval", **options), written


BLOCK = "lead_condition = ARRIVED = true\npass_condition = COLLISIONS = 0\nfail_condition = LATE = true\n"


@pytest.mark.parametrize(
    ("collisions", "late", "result", "status"),
    [
        (0, "false", "pass", "pass"),
        (1, "false", "fail", "unmet_pass_cond: [COLLISIONS = 0]"),
        (0, "true", "fail", "met_fail_cond: [LATE = true]"),
    ],
)
def test_the_grade_is_given_when_the_lead_conditions_hold(collisions, late, result, status):
    app, _ = evaluate(BLOCK)
    app.post("COLLISIONS", collisions).post("LATE", late).run(2)
    assert app.values("MISSION_RESULT") == ["pending"]
    assert app.values("MISSION_LCHECK_STAT") == ["unmet_lead_cond: [ARRIVED = true]"]
    app.post("ARRIVED", "true").run(1)
    assert app.values("MISSION_RESULT") == ["pending", result]
    assert app.values("MISSION_LCHECK_STAT")[-1] == status
    assert app.values("MISSION_EVALUATED") == ["true"]


def test_the_grade_is_final():
    app, _ = evaluate(BLOCK)
    app.post("COLLISIONS", 1).post("ARRIVED", "true").run(1).post("COLLISIONS", 0).run(5)
    assert app.values("MISSION_RESULT")[-1] == "fail"
    assert app.values("MISSION_EVALUATED") == ["true"]


def test_aspects_are_graded_one_after_the_other():
    app, _ = evaluate(
        "lead_condition = A = 1\npass_condition = P = 1\nlead_condition = B = 1\nlead_condition = C = 1\n"
        "pass_condition = P = 2"
    )
    app.post("P", 1).post("A", 1).run(1).post("P", 2).post("B", 1).run(1)
    assert app.values("MISSION_RESULT") == ["pending"]
    assert app.post("C", 1).run(1).values("MISSION_RESULT") == ["pending", "pass"]


def test_flags_go_out_in_the_order_of_the_reference_with_macros():
    app, _ = evaluate(
        BLOCK + "result_flag = R=$[GRADE]\npass_flag = P=$[COLLISIONS]\nfail_flag = F=1\n"
        'pass_flag = Q="$[MISSION_FORM]/$[MMOD]/$[NOBODY]"\nmission_form = joust\nmission_mod = fast'
    )
    app.post("COLLISIONS", 0).post("ARRIVED", "true").run(2)
    said = [
        (n, v) for _, n, v in app.said if n in ("R", "P", "Q", "F", "MISSION_EVALUATED", "MISSION_RESULT")
    ]
    assert said == [
        ("MISSION_RESULT", "pending"),
        ("R", "pass"),
        ("MISSION_EVALUATED", "true"),
        ("MISSION_RESULT", "pass"),
        ("P", 0.0),
        ("Q", "joust/fast/$[NOBODY]"),
    ]


@pytest.mark.parametrize(("form", "separator"), [("white", "  "), ("csp", ", ")])
def test_the_report_is_one_line_with_columns_known_early_first(form, separator):
    app, written = evaluate(
        BLOCK + f"report_file = r.txt\nreport_line_format = {form}\nprereport_column = $[MHASH_SHORT]\n"
        "report_column = $[GRADE]\nreport_column = n=$[COLLISIONS]\nreport_column = $[WALL_TIME]"
    )
    app.run(1)
    assert written == []
    app.post("MISSION_HASH", "mhash=241103-0834K-FOXY-WEED,utc=5").post("COLLISIONS", 0.5).run(1)
    assert written == ["[FOXY-WEED]"]
    app.post("ARRIVED", "true").run(1)
    assert written[1:] == ["  " + separator.join(["fail", "n=0.5", written[1].split(separator)[-1]])]
    assert float(written[1].split(separator)[-1]) == pytest.approx(2.0, abs=0.3)
    assert written[1].endswith("\n")


def test_without_a_hash_the_early_columns_are_written_with_the_result():
    app, written = evaluate(
        BLOCK + "report_file=r\nprereport_column = $[MHASH]x\nreport_column=$[DATE] $[TIME]"
    )
    app.post("ARRIVED", "true").run(1)
    assert "".join(written) == "x  2026:01:01 00:00:00\n"


def test_reports_are_appended_to_a_file(tmp_path):
    for _ in range(2):
        block = BLOCK + f"report_file = {tmp_path}/deep/r.txt\nreport_column = $[GRADE]"
        Harness(MissionEval, block).post("ARRIVED", "true").run(1)
    assert (tmp_path / "deep" / "r.txt").read_text() == "fail\nfail\n"


def test_a_mail_flag_answers_each_mail():
    app, _ = evaluate("mailflag = @PING PONG=$[PING]")
    app.run(1).post("PING", 1).run(1).post("PING", 2).run(1)
    assert app.values("PONG") == [1.0, 2.0]
    assert (
        parse_mail_flag("@A # B=c") == parse_mail_flag("@A# B=c") == parse_mail_flag("@A B=c") == ("A", "B=c")
    )
    with pytest.raises(ValueError, match="expected"):
        parse_mail_flag("A B=c")


@pytest.mark.parametrize("block", ["", "pass_condition = A = 1"])
def test_without_a_lead_condition_there_is_a_warning_and_no_grade(block):
    app, _ = evaluate(block)
    app.post("A", 1).run(5)
    assert app.app.log.config_warnings
    assert app.values("MISSION_RESULT") == ["pending"]


def test_a_lead_condition_behind_others_begins_the_next_aspect():
    keys = [
        "lead_condition",
        "lead_condition",
        "pass_condition",
        "fail_condition",
        "lead_condition",
        "pass_condition",
    ]
    aspects = build_aspects((key, parse_condition("A = 1")) for key in keys)
    assert [(len(a.leads), len(a.passes), len(a.fails)) for a in aspects] == [(2, 1, 1), (1, 1, 0)]


def test_macros_of_both_forms_are_expanded_and_unknown_ones_stay():
    assert expand_macros("$[A]$(A)$[B]", {"A": "1"}) == "11$[B]"


NAMES = st.sampled_from(["A = 1", "B = 1", "C = 1"])
CONDITIONS = st.lists(NAMES, max_size=2)


@given(
    st.lists(
        st.tuples(st.lists(NAMES, min_size=1, max_size=2), CONDITIONS, CONDITIONS), min_size=1, max_size=3
    ),
    st.lists(st.dictionaries(st.sampled_from("ABC"), st.sampled_from([0.0, 1.0])), max_size=6),
)
def test_the_grade_is_that_of_a_slow_walk_through_the_aspects(aspects, worlds):
    evaluation = Evaluation([Aspect(*([parse_condition(c) for c in group] for group in a)) for a in aspects])
    at, expected = 0, "pending"
    for world in worlds:
        true = {f"{name} = 1" for name, value in world.items() if value == 1.0}
        while expected == "pending" and set(aspects[at][0]) <= true:
            if not set(aspects[at][1]) <= true or set(aspects[at][2]) & true:
                expected = "fail"
            else:
                at += 1
                expected = "pass" if at == len(aspects) else "pending"
        evaluation.update(world.get)
        assert evaluation.result == expected
