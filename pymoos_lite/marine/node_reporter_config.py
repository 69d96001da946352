"""Declared parameters of the node reporter (marine_apps.md 3.2)."""

from __future__ import annotations

from typing import Any

from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.marine.ownship_state import CROSS_FILL_POLICIES
from pymoos_lite.marine.platform_report import parse_platform_input
from pymoos_lite.marine.riders import parse_rider


def _policy(text: str) -> str:
    word = text.strip().lower().replace("_", "-")
    if word not in CROSS_FILL_POLICIES:
        raise ValueError(f"expected one of {', '.join(CROSS_FILL_POLICIES)}")
    return word


def _aspect(text: str) -> tuple[str, str]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals and value):
        raise ValueError("expected key=value")
    return key, value


def _text(name: str, doc: str, default: str = "", *aliases: str) -> Parameter:
    return Parameter(name, "text", default, "", doc, aliases=aliases)


def _switch(name: str, doc: str) -> Parameter:
    return Parameter(name, "boolean", False, "", doc)


def _number(name: str, default: float | None, unit: str, doc: str, *aliases: str, **more: Any) -> Parameter:
    return Parameter(name, "number", default, unit, doc, aliases=aliases, **more)


NODE_REPORTER_DECLARATION = Declaration(
    (
        _text("platform_type", "Kind of vessel: kayak, ship, auv ...", "unknown", "vessel_type"),
        _text("platform_color", "Colour by name, for viewers."),
        _number("platform_length", None, "m", "Length; by type if not given.", "vessel_length", low=0.0),
        _number("platform_beam", None, "m", "Beam.", low=0.0),
        Parameter(
            "platform_aspect",
            "custom",
            None,
            "",
            "A further field of every report.",
            parse=_aspect,
            repeated=True,
            example="crew=4",
        ),
        _number("platform_transparency", None, "", "How transparent viewers draw the vessel, 0 to 1."),
        _text("platform_group", "Group that the vessel belongs to.", "", "group"),
        _text("platform_vsource", "Where the report comes from, e.g. ais.", "", "vsource"),
        Parameter(
            "node_report_output",
            "variable",
            "NODE_REPORT_LOCAL",
            "",
            "Variable that receives the report.",
            aliases=("node_report_var", "node_report_summary"),
        ),
        Parameter(
            "plat_report_input",
            "custom",
            None,
            "",
            "A variable of the platform report.",
            parse=parse_platform_input,
            repeated=True,
            example="BATTERY,gap=10,alias=BATT",
            aliases=("plat_report_var", "platform_variable"),
        ),
        Parameter(
            "plat_report_output",
            "variable",
            "PLATFORM_REPORT_LOCAL",
            "",
            "Variable that receives the platform report.",
        ),
        _switch("coord_policy_global", "Report latitude and longitude only."),
        _switch("terse_reports", "Leave out depth, yaw, and latitude and longitude."),
        _text("json_report", "true: JSON instead of CSP; a variable: JSON to that as well."),
        Parameter(
            "rider",
            "custom",
            None,
            "",
            "A variable that travels in the report.",
            parse=parse_rider,
            repeated=True,
            example="var=BATTERY, policy=updated+10, rfld=BATT, prec=1",
        ),
        Parameter(
            "cross_fill_policy",
            "custom",
            "literal",
            "",
            "How x,y and lat,lon are filled from each other: " + ", ".join(CROSS_FILL_POLICIES) + ".",
            parse=_policy,
        ),
        _number("nav_grace_period", 60.0, "s", "Time without complete navigation before a warning."),
        _number(
            "nohelm_threshold",
            5.0,
            "s",
            "Silence after which the helm is missing.",
            low=0.0,
            open_low=True,
        ),
        _number("blackout_interval", 0.0, "s", "Least time between reports."),
        _number("blackout_variance", 0.0, "s", "Random variation of that time, either way.", low=0.0),
        _switch("extrap_enabled", "Leave out reports that receivers can extrapolate."),
        _number("extrap_pos_thresh", 0.25, "m", "Position error that calls for a report.", low=0.0),
        _number("extrap_hdg_thresh", 1.0, "deg", "Heading error that calls for a report.", low=0.0),
        _number("extrap_max_gap", 5.0, "s", "Longest time without a report.", low=0.0),
        _text("alt_nav_prefix", "Prefix of a second navigation, reported under another name."),
        _text("alt_nav_name", "Name of that report; with a leading _ appended to the vessel's.", "_GT"),
        _text("alt_nav_group", "Group of that report; the vessel's if empty."),
        _switch("paused", "Start without reporting."),
        _switch("allow_color_change", "Heed NODE_COLOR_CHANGE."),
        _switch("report_cog", "Report course over ground from successive positions."),
        _number("hdg_error", 0.0, "deg", "Added to the reported heading.", low=0.0),
    )
)
