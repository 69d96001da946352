"""The parameters that every behaviour understands (helm.md 4.1), declared once."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from ivp_helm.conditions import Condition, ConditionError, parse_condition
from ivp_helm.flags import CLEAR, Flag, parse_flag, typed_value
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError, parse_boolean, parse_number

NAME = re.compile(r"[A-Za-z0-9_\-\[\]()#@+]+\Z")
NO_LIMIT = -1.0

FLAG_KEYS = (
    "runflag",
    "runxflag",
    "activeflag",
    "inactiveflag",
    "idleflag",
    "endflag",
    "spawnflag",
    "spawnxflag",
    "configflag",
)


def flag_parameter(name: str, doc: str, *aliases: str) -> Parameter:
    """A repeatable flag parameter; the text ``clearall`` in an update empties it."""
    return Parameter(
        name, "custom", None, "", doc, parse=read_flag, repeated=True, aliases=aliases, example="VAR=value"
    )


def read_flag(text: str) -> Flag | None:
    """A flag, or None for ``clearall``."""
    return None if text.strip().lower() == CLEAR else parse_flag(text)


def read_condition(text: str) -> Condition:
    """A condition in which the legacy comma stands for ``=`` (helm.md 2.1)."""
    try:
        return parse_condition(text.replace(",", "="))
    except ConditionError as error:
        raise ParameterError(str(error)) from None


def read_name(text: str) -> str:
    """A behaviour's name.

    Raises:
        ParameterError: it holds another character than letters, digits and ``_-[]()#@+``.
    """
    name = text.strip()
    if not NAME.match(name):
        raise ParameterError(
            f"name = {text.strip()!r}: only letters, digits and _ - [ ] ( ) # @ + are allowed"
        )
    return name


def _duration(text: str) -> float:
    if text.lower() in ("no-time-limit", "-1"):
        return NO_LIMIT
    seconds = _seconds(text)
    if seconds is None:
        raise ParameterError(f"duration = {text!r}: give seconds of at least 0, or no-time-limit")
    return seconds


def _seconds(text: str) -> float | None:
    try:
        value = parse_number(text)
    except ValueError:
        return None
    return value if value >= 0.0 else None


def _nostarve(text: str) -> tuple[tuple[str, ...], float]:
    *names, last = (piece.strip() for piece in text.split(","))
    seconds = _seconds(last)
    if not names or not all(names) or not seconds:
        raise ParameterError(f"nostarve = {text!r}: expected VAR1,VAR2,...,SECONDS with seconds above 0")
    return tuple(names), seconds


def _post_mapping(text: str) -> tuple[str, str]:
    source, comma, target = (piece.strip() for piece in text.partition(","))
    if not comma or not source or not target or re.search(r"[\s,]", source + target):
        raise ParameterError(f"post_mapping = {text!r}: expected VAR,NEWVAR or VAR,silent, without blanks")
    return source, target


def _duration_reset(text: str) -> tuple[str, float | str | None]:
    name, equals, value = (piece.strip() for piece in text.partition("="))
    if not name or re.search(r"\s", name) or (equals and not value):
        raise ParameterError(f"duration_reset = {text!r}: expected VAR or VAR=VALUE")
    return name, typed_value(value) if equals else None


def _custom(
    name: str, parse: Callable[[str], Any], default: Any, doc: str, example: str = "", **more: Any
) -> Parameter:
    return Parameter(name, "custom", default, more.pop("unit", ""), doc, parse=parse, example=example, **more)


BASE_PARAMETERS = Declaration(
    (
        _custom("name", read_name, "", "The behaviour's name.", aliases=("descriptor",)),
        Parameter(
            "pwt",
            "number",
            100.0,
            "",
            "Priority weight; 0 is no say at all.",
            low=0.0,
            aliases=("priority", "priwt"),
        ),
        _custom(
            "condition",
            read_condition,
            None,
            "Must hold for the behaviour to run; several must hold together.",
            "DEPLOY = true",
            repeated=True,
        ),
        flag_parameter("runflag", "Posted on starting to run.", "run_flag"),
        flag_parameter("runxflag", "Posted in every running iteration.", "runx_flag"),
        flag_parameter("activeflag", "Posted on starting to have a say in the decision.", "active_flag"),
        flag_parameter("inactiveflag", "Posted on ceasing to have a say.", "inactive_flag"),
        flag_parameter("idleflag", "Posted on going idle.", "idle_flag"),
        flag_parameter("endflag", "Posted on each completion.", "end_flag"),
        flag_parameter("spawnflag", "Posted when spawned.", "spawn_flag"),
        flag_parameter("spawnxflag", "Posted in the first iteration.", "spawnx_flag"),
        flag_parameter("configflag", "Posted at start and after each update.", "config_flag"),
        Parameter("updates", "text", "", "", "Variable that carries param=value # param=value at run time."),
        _custom(
            "duration",
            _duration,
            NO_LIMIT,
            "Seconds after which the behaviour completes, from its first run.",
            "no-time-limit",
            unit="s",
        ),
        Parameter("duration_status", "variable", "", "", "Variable that receives the remaining seconds."),
        _custom(
            "duration_reset", _duration_reset, None, "A fresh post of this restarts the clock.", "VAR=VALUE"
        ),
        Parameter("duration_idle_decay", "boolean", True, "", "Whether idle time counts."),
        _custom(
            "nostarve",
            _nostarve,
            None,
            "Idle when any of the variables is older than so many seconds.",
            "VAR1,VAR2,10",
            repeated=True,
            aliases=("no_starve",),
        ),
        Parameter("perpetual", "boolean", False, "", "Stay alive after completion."),
        _custom(
            "post_mapping",
            _post_mapping,
            None,
            "Posts to VAR go to NEWVAR, or nowhere if that is 'silent'.",
            "VAR,NEWVAR",
            repeated=True,
        ),
        Parameter(
            "comms_policy", "choice", "open", "", "How much to post.", choices=("open", "lean", "dire")
        ),
        Parameter(
            "i_understand_this_behavior_is_deprecated",
            "boolean",
            False,
            "",
            "Use a deprecated behaviour all the same.",
        ),
        Parameter(
            "build_info",
            "text",
            "",
            "",
            "Hints for building functions, name=value # name=value; 'clear' empties.",
        ),
    ),
    ignored=("us",),
)


def _positive_whole(text: str) -> int:
    value = parse_number(text)
    if value < 0 or value != int(value):
        raise ParameterError(f"max_spawnings = {text!r}: give a whole number of at least 0")
    return int(value)


TEMPLATE_PARAMETERS = Declaration(
    (
        Parameter(
            "templating",
            "choice",
            "disallow",
            "",
            "spawn: make instances on request; clone: one at start and more on request.",
            choices=("spawn", "clone", "disallow"),
        ),
        _custom("max_spawnings", _positive_whole, 0, "Most instances ever made; 0 is no limit.", "0"),
    )
)
"""Consumed by the loader; no behaviour sees them."""

__all__ = [
    "BASE_PARAMETERS",
    "FLAG_KEYS",
    "NO_LIMIT",
    "TEMPLATE_PARAMETERS",
    "flag_parameter",
    "parse_boolean",
    "read_condition",
    "read_flag",
    "read_name",
]
