"""The parameters that every contact behaviour understands (behaviors.md B4, helm.md 4.5), declared once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ivp_helm.bearing_line import BearingLine, parse_bearing_line
from ivp_helm.flags import CLEAR, Flag, parse_flag
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError
from pymoos_lite.geometry.encounter import ContactTag
from pymoos_lite.records.contact_ledger import parse_decay

FILTER_LISTS = (
    "ignore_group",
    "match_group",
    "ignore_name",
    "match_name",
    "ignore_type",
    "match_type",
    "ignore_region",
    "match_region",
)
"""In the order in which alert requests name them."""


def read_contact_flag(text: str) -> Flag | None:
    """A flag with a tag that says when it is due, or None for ``clearall``.

    Raises:
        ValueError: it has no tag, or one that contact flags do not know.
    """
    if text.strip().lower() == CLEAR:
        return None
    flag = parse_flag(text)
    if not flag.tag:
        raise ParameterError(
            f"cnflag = {text.strip()!r} does not say when: put a tag before it, e.g. '@cpa {text.strip()}'"
        )
    ContactTag.parse(flag.tag)
    return flag


def _custom(name: str, parse: Callable[[str], Any], default: Any, doc: str, **more: Any) -> Parameter:
    return Parameter(name, "custom", default, more.pop("unit", ""), doc, parse=parse, **more)


def _filter_list(name: str) -> Parameter:
    sense, _, kind = name.partition("_")
    whom = "no" if sense == "ignore" else "only"
    what = "inside this convex polygon" if kind == "region" else f"of these {kind}s"
    example = "pts={0,0:50,0:50,50}" if kind == "region" else "a,b"
    return Parameter(
        name, "text", None, "", f"Act on {whom} contacts {what}.", repeated=True, example=example
    )


def _decay(text: str) -> tuple[float, float]:
    return parse_decay(text)


def _bearing_line(text: str) -> BearingLine:
    return parse_bearing_line(text)


CONTACT_PARAMETERS = Declaration(
    (
        Parameter("contact", "text", "", "", "The contact's name; templates have it set on spawning."),
        Parameter(
            "on_no_contact_ok",
            "boolean",
            True,
            "",
            "Whether an unknown contact is no reason to stop the vehicle.",
        ),
        Parameter(
            "extrapolate", "boolean", True, "", "Accepted; contacts are where they were last reported."
        ),
        _custom(
            "decay",
            _decay,
            (15.0, 30.0),
            "Accepted, as extrapolate: start,end of slowing down.",
            unit="s",
            example="15,30",
        ),
        Parameter("decay_end", "number", 30.0, "s", "The older way to give the end of decay.", low=0.0),
        Parameter(
            "time_on_leg", "number", 60.0, "s", "How far ahead a closest point of approach counts.", low=0.0
        ),
        *(_filter_list(name) for name in FILTER_LISTS),
        Parameter(
            "strict_ignore",
            "boolean",
            True,
            "",
            "Where groups or types are ignored, ignore unknown ones too.",
        ),
        Parameter("exit_on_filter_vtype", "boolean", False, "", "Complete when the type's filter fails."),
        Parameter("exit_on_filter_group", "boolean", False, "", "Complete when the group's filter fails."),
        Parameter("exit_on_filter_region", "boolean", False, "", "Complete when the region's filter fails."),
        _custom(
            "cnflag",
            read_contact_flag,
            None,
            "Posted at a moment of the encounter, e.g. '@<30 NEAR=$[CN_NAME]' or '@cpa CPA=$[RANGE]'.",
            repeated=True,
            aliases=("cn_flag",),
            example="@cpa VAR=value",
        ),
        Parameter("post_per_contact_info", "boolean", False, "", "Post figures of each contact."),
        _custom(
            "bearing_line_config",
            _bearing_line,
            None,
            "Draw a line to the contact, coloured by relevance (or range).",
            aliases=("bearing_lines",),
            example="white:0, green:0.65, yellow:0.8, red:1.0",
        ),
        Parameter("bearing_line_show", "boolean", False, "", "Draw a line to the contact."),
        Parameter("bearing_line_label_show", "boolean", False, "", "Write the line's label next to it."),
        Parameter(
            "use_plat_model", "boolean", False, "", "Take own ship's turn into account in closest approaches."
        ),
    )
)
