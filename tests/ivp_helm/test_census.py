"""Every construct that the stock missions use, parsed and acting as specified (helm.md 14).

One row per construct of the census: a `.bhv` text of our own, mail, and what must have come of it. The
mission below each row has a waypoint behaviour `w` unless the row brings its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from ivp_helm.testing import HelmRig
from pymoos_lite.config.parameters import Declaration, Parameter


def waypoint(*lines: str, name: str = "w") -> str:
    """A waypoint block that runs (three points in a row to the north)."""
    body = "\n".join(
        f"  {line}" for line in (f"name = {name}", "points = 0,50:0,100:0,150", "speed = 2", *lines)
    )
    return f"Behavior = BHV_Waypoint\n{{\n{body}\n}}\n"


Check = Callable[[HelmRig], bool]


@dataclass(frozen=True)
class Row:
    construct: str
    text: str
    check: Check
    mail: tuple[tuple[str, object], ...] = ()
    iterations: int = 1
    own: dict[str, float] = field(default_factory=dict)


def state(name: str, wanted: str) -> Check:
    return lambda helm: helm.outcome(name).state == wanted


def posts(variable: str, *values: object) -> Check:
    return lambda helm: helm.posted(variable) == list(values)


AT_FIRST = {"x": 0.0, "y": 49.0}

ROWS = [
    # --- the file
    Row("Behavior = block, header and brace on separate lines", waypoint(), state("w", "active")),
    Row(
        "block without header",
        "//Behavior = BHV_Loiter\n{\n  name = off\n}\n\n" + waypoint(),
        state("w", "active"),
    ),
    Row("initialize", "initialize A = true\n", posts("A", "true")),
    Row(
        "initialize with a list",
        "initialize A=false, B = 2\n",
        lambda h: (h.posted("A"), h.posted("B")) == (["false"], [2.0]),
    ),
    Row("initialize_", "initialize_ A = 1\n", posts("A", 1.0), mail=(("IVPHELM_STATE@pHelmIvP", "DRIVE"),)),
    Row("full comment line", "// hello\n  // again\n" + waypoint(), state("w", "active")),
    Row("trailing comment", waypoint("pwt = 30 // less"), lambda h: h.outcome("w").function.weight == 30.0),
    Row("backslash continuation", waypoint("pwt = 3\\\n0"), lambda h: h.outcome("w").function.weight == 30.0),
    # --- modes
    Row("set with else on the closing line", "set MODE = GO {\n  D = true\n} STAY\n", posts("MODE", "STAY")),
    Row("set without else", "set MODE = GO {\n  D = true\n}\n", posts("MODE", "GO"), mail=(("D", "true"),)),
    Row(
        "set of another variable",
        "set IVPHELM_MODE = GO {\n  D != true\n} STAY\n",
        posts("IVPHELM_MODE", "GO"),
        mail=(("D", "no"),),
    ),
    Row(
        "set Set with capital",
        "Set MODE = STATION-KEEPING {\n D = 1\n}\n",
        posts("MODE", "STATION-KEEPING"),
        mail=(("D", 1),),
    ),
    Row(
        "set with a nested parent",
        "set MODE = A {\n D = 1\n}\nset MODE = B {\n MODE = A\n} \nset MODE = C {\n MODE = A:B\n}\n",
        posts("MODE", "A:B:C"),
        mail=(("D", 1),),
    ),
    # --- base parameters
    Row("pwt", waypoint("pwt = 20"), lambda h: h.outcome("w").function.weight == 20.0),
    Row("priority", waypoint("priority = 20"), lambda h: h.outcome("w").function.weight == 20.0),
    Row("updates", waypoint("updates = UP"), lambda h: h.decision["speed"] == 4.0, mail=(("UP", "speed=4"),)),
    Row("endflag", waypoint("endflag = DONE = true", "points = 0,0"), posts("DONE", "true")),
    Row(
        "perpetual",
        waypoint("perpetual = true", "points = 0,0", "endflag = N=$[CTR]"),
        posts("N", 1.0, 2.0),
        iterations=2,
    ),
    Row("duration = no-time-limit", waypoint("duration = no-time-limit"), state("w", "active")),
    Row("duration", waypoint("duration = 0.5", "endflag = OVER=1"), posts("OVER", 1.0), iterations=3),
    Row(
        "duration_reset",
        waypoint("duration = 0.5", "duration_reset = MORE=true", "duration_status = LEFT"),
        posts("LEFT", 0.5),
        mail=(("MORE", "true"),),
    ),
    Row(
        "duration_idle_decay",
        waypoint("duration = 0.5", "duration_idle_decay = false"),
        state("w", "active"),
        iterations=2,
    ),
    Row("runflag", waypoint("runflag = R=1"), posts("R", 1.0), iterations=2),
    Row("activeflag", waypoint("activeflag = R=1"), posts("R", 1.0), iterations=2),
    Row("inactiveflag", waypoint("inactiveflag = R=1", "condition = X = 1"), posts("R", 1.0), iterations=2),
    Row("idleflag", waypoint("idleflag = R=1", "condition = X = 1"), posts("R", 1.0), iterations=2),
    Row("spawnx_flag", waypoint("spawnx_flag = R=1"), posts("R", 1.0), iterations=2),
    Row("spawnxflag", waypoint("spawnxflag = R=1"), posts("R", 1.0), iterations=2),
    Row("configflag", waypoint("configflag = R=1"), posts("R", 1.0), iterations=2),
    Row("runxflag", waypoint("runxflag = R=1"), posts("R", 1.0, 1.0), iterations=2),
    Row(
        "templating = spawn",
        waypoint("templating = spawn", "updates = UP", name="w_"),
        lambda h: h.outcome("w_a").state == "active",
        mail=(("UP", "name=a"),),
    ),
    Row(
        "templating = clone",
        waypoint("templating = clone", "updates = UP", name="w_"),
        lambda h: {o.state for _, o in h.core.trace.rounds} == {"active"} and len(h.core.trace.rounds) == 2,
        mail=(("UP", "name=a"),),
    ),
    Row(
        "max_spawnings",
        waypoint("templating = spawn", "updates = UP", "max_spawnings = 1", name="w_"),
        lambda h: len(h.core.trace.rounds) == 1,
        mail=(("UP", "name=a"), ("UP", "name=b")),
    ),
    Row("nostarve", waypoint("nostarve = X,2"), state("w", "idle")),
    Row("post_mapping", waypoint("runflag = R=1", "post_mapping = R,S"), posts("S", 1.0)),
    Row("comms_policy", waypoint("comms_policy = dire"), posts("VIEW_POINT")),
    # --- flags
    Row(
        "flag with a destination",
        waypoint("runflag = #all R=1"),
        lambda h: "var_name=R" in str(h.posted("NODE_MESSAGE_LOCAL")[0]),
    ),
    Row(
        "flag with [if]",
        waypoint("runflag = R=1 [if] X = 1", "runflag = S=1 [if] X = 2"),
        lambda h: (h.posted("R"), h.posted("S")) == ([1.0], []),
        mail=(("X", 1),),
    ),
    Row(
        "flag whose value holds equals signs",
        waypoint("runflag = SUMMARY=speed=$[SPEED],time=5"),
        posts("SUMMARY", "speed=2,time=5"),
    ),
    Row(
        "flag with a JSON-like value",
        waypoint('runflag = J={"a": "$[OWNSHIP]"}'),
        posts("J", '{"a": "alpha"}'),
    ),
    # --- conditions
    Row(
        "condition VAR = value", waypoint("condition = A = true"), state("w", "active"), mail=(("A", "true"),)
    ),
    Row("condition with case", waypoint("condition = A = true"), state("w", "idle"), mail=(("A", "TRUE"),)),
    Row(
        "condition ==",
        waypoint("condition = MODE==LOITERING"),
        state("w", "active"),
        mail=(("MODE", "ACTIVE:LOITERING"),),
    ),
    Row(
        "condition == with fields",
        waypoint("condition = MODE == A:B:C"),
        state("w", "active"),
        mail=(("MODE", "A:B:C"),),
    ),
    Row("condition !=", waypoint("condition = MODE != HOME"), state("w", "active"), mail=(("MODE", "AWAY"),)),
    Row("condition != of an unknown variable", waypoint("condition = MODE != HOME"), state("w", "idle")),
    Row(
        "condition with and",
        waypoint("condition = (A = 1) and (B = 2)"),
        state("w", "idle"),
        mail=(("A", 1),),
    ),
    Row(
        "condition nested two levels",
        waypoint("condition = ((A = 1) or (B = 2)) or (C = 3)"),
        state("w", "active"),
        mail=(("C", 3),),
    ),
    Row("condition in parentheses", waypoint("condition = (NAV_SPEED < 2)"), state("w", "active")),
    Row(
        "condition < and >",
        waypoint("condition = NAV_SPEED > 0.5", "condition = NAV_SPEED < 1.5"),
        state("w", "active"),
    ),
    Row("condition !( )", waypoint("condition = !(A = 1)"), state("w", "active")),
    Row(
        "condition with a quoted literal",
        waypoint('condition = A = "1"'),
        state("w", "active"),
        mail=(("A", "1"),),
    ),
    Row(
        "condition with $(VAR)",
        waypoint("condition = A = $(B)"),
        state("w", "active"),
        mail=(("A", 4), ("B", 4)),
    ),
    Row(
        "condition with a comma", waypoint("condition = A,true"), state("w", "active"), mail=(("A", "true"),)
    ),
    Row(
        "condition, repeated",
        waypoint("condition = A = 1", "condition = B = 1"),
        state("w", "idle"),
        mail=(("A", 1),),
    ),
    # --- macros
    Row(
        "macros OSX OSY",
        waypoint("runflag = P=$[OSX],$[OSY]"),
        posts("P", "1.5,-2.25"),
        own={"x": 1.5, "y": -2.25},
    ),
    Row("macro SPEED", waypoint("runflag = P=$[SPEED]"), posts("P", 2.0)),
    Row("macros NX NY", waypoint("runflag = P=$[NX]:$(NY)"), posts("P", "0:50")),
    Row("macros PX PY", waypoint("wptflag = P=$[PX]:$[PY]"), posts("P", "0:50"), own=AT_FIRST),
    Row("macro CTR", waypoint("runxflag = P=$[CTR]"), posts("P", 1.0, 2.0), iterations=2),
    Row("macro CTR2", waypoint("runxflag = P=n$[CTR2]"), posts("P", "n1", "n2"), iterations=2),
    Row("macro OWNSHIP", waypoint("runflag = P=$[OWNSHIP]"), posts("P", "alpha")),
    Row("macro UTC", waypoint("runflag = P=$[UTC]"), posts("P", 1_700_000_000.25)),
    Row(
        "macro DUR_RUN_TIME",
        waypoint("runxflag = P=$[DUR_RUN_TIME]"),
        posts("P", 0.0, 0.0, 0.25),
        iterations=3,
    ),
    Row("macro in round brackets", waypoint("runflag = P=$(OWNSHIP)-$(BHVNAME)"), posts("P", "alpha-w")),
    # --- the most used parameters of behaviours
    Row(
        "visual_hints",
        waypoint("visual_hints = vertex_size=4, edge_color=green", "visual_hints = nextpt_color=red"),
        lambda h: (
            "edge_color=green" in str(h.posted("VIEW_SEGLIST")[0])
            and "vertex_color=red" in str(h.posted("VIEW_POINT")[0])
        ),
    ),
    Row("speed", waypoint("speed = 3"), lambda h: h.decision["speed"] == 3.0),
    Row("points", waypoint("points = pts={50,0:100,0}"), lambda h: h.decision["course"] == 90.0),
    Row("polygon", waypoint("polygon = format=radial,x=0,y=100,radius=20,pts=4"), state("w", "active")),
    Row("radius and nm_radius", waypoint("radius = 60", "nm_radius = 70"), posts("WPT_INDEX", 1.0)),
    Row(
        "capture_radius and slip_radius",
        waypoint("capture_radius = 60", "slip_radius = 70"),
        posts("WPT_INDEX", 1.0),
    ),
    Row("repeat", waypoint("points = 0,0", "repeat = 1", "perpetual = true"), state("w", "active")),
    Row(
        "lead and lead_damper",
        waypoint("lead = 8", "lead_damper = 1", "lead_to_start = true"),
        lambda h: "y=24" in str(h.posted("VIEW_POINT")[1]),
    ),
    Row("capture_line", waypoint("capture_line = true"), state("w", "active")),
    Row("order", waypoint("order = reverse"), lambda h: "x=0,y=150" in str(h.posted("VIEW_POINT")[0])),
    Row("wptflag", waypoint("wptflag = HIT=$[PI]"), posts("HIT", 0.0), own=AT_FIRST),
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.construct.replace(" ", "_"))
def test_the_construct_acts_as_specified(row: Row) -> None:
    helm = HelmRig(text=row.text, domain=("course:0:359:360", "speed:0:5:21"))
    helm.own(**{"heading": 0.0, "speed": 1.0, **row.own})
    for name, value in row.mail:
        variable, _, source = name.partition("@")
        helm.mail(variable, value, source or "test")
    helm.iterate(row.iterations)
    assert row.check(helm), (helm.published, helm.core.trace)


def test_nsplug_lines_are_refused_with_a_hint():
    helm = HelmRig(text="#include plug.bhv\n", faulty=True)
    assert "run nsplug on this file first" in str(helm.core.problems[0])


class Tagged(Behavior):
    """A behaviour with a contact and a tagged flag."""

    BHV_NAME = "BHV_Tagged"
    VARIABLES = ()
    PARAMETERS = Declaration((Parameter("contact", "text", "", "", "Whom it is about."),))

    def on_run(self) -> IvPFunction | None:
        self.post("RAN", "true")
        return None


def test_the_contact_stands_in_conditions_in_three_spellings_and_as_a_macro_in_flags():
    helm = HelmRig(
        [
            (
                Tagged,
                {
                    "name": "t",
                    "contact": "Ben",
                    "condition": ["TAGGED_$[CONTACT] = true", "X_$[contact] = 1", "Y_$[Contact] = 1"],
                    "runflag": "WHO=$[CONTACT]",
                },
            )
        ]
    )
    helm.own()
    assert {"TAGGED_BEN", "X_ben", "Y_Ben"} <= set(helm.posted("IVPHELM_REGISTER"))
    helm.mail("TAGGED_BEN", "true")
    helm.mail("X_ben", 1)
    helm.iterate()
    assert helm.posted("RAN") == []
    helm.mail("Y_Ben", 1)
    helm.iterate()
    assert helm.posted("RAN") == ["true"]
    assert helm.posted("WHO") == ["Ben"]
