"""Parameters that every app understands (community.md 7.2, 10.1)."""

from __future__ import annotations

from pymoos_lite.config.parameters import Declaration, Parameter, parse_boolean


def _app_logging(text: str) -> str:
    word = text.strip().lower()
    if word in ("log", "file"):
        return word
    return "log" if parse_boolean(word) else "off"


STANDARD_PARAMETERS = Declaration(
    (
        Parameter(
            "AppTick", "number", None, "Hz", "Iterations per mission second; 0 runs flat out.", high=1000.0
        ),
        Parameter("CommsTick", "number", 5.0, "Hz", "Accepted; mail moves as soon as it can."),
        Parameter(
            "MaxAppTick", "number", 5.0, "Hz", "Ceiling in iterate modes 1 and 2; 0 is no ceiling.", low=0.0
        ),
        Parameter(
            "IterateMode",
            "integer",
            0,
            "",
            "0: mail and iterate at AppTick. 1: also as soon as mail comes, at most MaxAppTick. "
            "2: mail as it comes, iterate at AppTick.",
        ),
        Parameter("SortMailByTime", "boolean", True, "", "Sort each batch of mail by its time stamps."),
        Parameter("CatchCommandMessages", "boolean", False, "", "Hear <APP>_CMD."),
        Parameter(
            "TERM_REPORT_INTERVAL",
            "number",
            0.5,
            "wall s",
            "Least time between two reports.",
            low=0.0,
            high=10.0,
            clip=True,
        ),
        Parameter("MAX_APPCAST_EVENTS", "integer", 8, "", "Events shown in a report.", low=0, high=50),
        Parameter(
            "MAX_APPCAST_RUN_WARNINGS",
            "integer",
            10,
            "",
            "Distinct run warnings shown.",
            low=0,
            high=1000,
            aliases=("MAX_APPCAST_RUNWARNINGS",),
        ),
        Parameter(
            "APP_LOGGING",
            "custom",
            "off",
            "",
            "Post what the app prints as APP_LOG: off, true or file.",
            parse=_app_logging,
        ),
        Parameter("DEPRECATED_OK", "boolean", False, "", "Do not warn that the app is deprecated."),
        Parameter(
            "COMMS_POLICY",
            "choice",
            "open",
            "",
            "How much the app may say over the air.",
            choices=("open", "lean", "dire"),
        ),
    ),
    ignored=("moos_no_colour", "moos_quiet", "moos_suicide_disable"),
)
