"""The ProcessConfig block of a helm, declared once (helm.md 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ivp_helm.ivp import Domain, DomainEntry, IvPError, parse_entry
from ivp_helm.platform_model import read_turn_model
from pymoos_lite.config.parameters import (
    Declaration,
    Parameter,
    ParameterError,
    Values,
    parse_boolean,
    parse_number,
)
from pymoos_lite.geometry.turn_paths import TurnModel


def _domain(text: str) -> DomainEntry:
    try:
        return parse_entry("".join(text.split()))
    except IvPError as error:
        raise ParameterError(str(error)) from None


def _skew(text: str) -> float:
    if text.strip().lower() == "any":
        return math.inf
    value = parse_number(text)
    if value < 0.0:
        raise ParameterError(f"ok_skew = {text!r}: give seconds of at least 0, or any")
    return value


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for name in (piece.strip() for piece in text.split(",")) if name)


def _verbosity(text: str) -> str:
    word = text.strip().lower()
    if word in ("verbose", "terse", "quiet"):
        return word
    return "verbose" if parse_boolean(word) else "terse"


def _standby(text: str) -> float:
    value = parse_number(text)
    if value <= 0.0:
        raise ParameterError(f"standby = {text!r}: give seconds above 0")
    return value


HELM_PARAMETERS = Declaration(
    (
        Parameter("Behaviors", "text", None, "", "A .bhv file.", repeated=True, example="alpha.bhv"),
        Parameter(
            "Domain",
            "custom",
            None,
            "",
            "A decision variable: name:low:high:points[:optional], or delta=X for points.",
            parse=_domain,
            repeated=True,
            example="course:0:359:360",
        ),
        Parameter(
            "verbose",
            "custom",
            "verbose",
            "",
            "verbose, terse or quiet; kept for MOOS-IvP.",
            parse=_verbosity,
        ),
        Parameter(
            "start_in_drive",
            "boolean",
            False,
            "",
            "Take control at start.",
            aliases=("start_indrive", "start_engaged", "active_start"),
        ),
        Parameter("allow_park", "boolean", True, "", "Obey an override that asks to park."),
        Parameter("park_on_allstop", "boolean", False, "", "Park on any all-stop."),
        Parameter(
            "ok_skew", "custom", 60.0, "s", "Mail stamped farther from now is ignored; any.", parse=_skew
        ),
        Parameter("node_skew", "text", "", "", "Accepted; without effect.", repeated=True),
        Parameter(
            "hold_on_apps",
            "custom",
            None,
            "",
            "Helm-start messages wait until these clients are connected.",
            parse=_names,
            repeated=True,
            aliases=("hold_on_app",),
        ),
        Parameter(
            "nav_grace", "number", 5.0, "s", "Patience before missing navigation is a warning.", low=0.0
        ),
        Parameter(
            "nav_timeout",
            "number",
            0.0,
            "s",
            "All-stop when own position is older than this; 0: never (as MOOS-IvP). An addition of ours.",
            low=0.0,
        ),
        Parameter(
            "contact_max_age",
            "number",
            45.0,
            "s",
            "Contacts not heard of for longer are dropped.",
            low=10.0,
            high=1800.0,
        ),
        Parameter(
            "contact_extrapolation",
            "number",
            0.0,
            "s",
            "Move contacts on by their reports for at most so long; 0: never (as MOOS-IvP). An addition of ours.",
            low=0.0,
        ),
        Parameter(
            "ivp_behavior_dir",
            "text",
            None,
            "",
            "A folder with behaviour plug-ins.",
            repeated=True,
            aliases=("ivp_behavior_dirs",),
        ),
        Parameter(
            "bhv_dir_not_found_ok",
            "boolean",
            False,
            "",
            "Do not mind a missing plug-in folder.",
            aliases=("bhv_dirs_not_found_ok",),
        ),
        Parameter(
            "goals_mandatory", "boolean", False, "", "All-stop when only constraint behaviours have a say."
        ),
        Parameter("helm_prefix", "text", "", "", "Put in front of the decision variables."),
        Parameter("helm_alias", "text", "", "", "Posted as IVPHELM_ALIAS."),
        Parameter("other_override_var", "variable", "", "", "One more override variable."),
        Parameter(
            "standby",
            "custom",
            0.0,
            "s",
            "Be a stand-by helm that takes over after this silence.",
            parse=_standby,
        ),
        Parameter(
            "pmgen",
            "custom",
            None,
            "",
            "Turn model: alg=holo, or alg=dubins # radius=M # spoke_degs=DEG.",
            parse=read_turn_model,
            example="alg=holo",
        ),
        Parameter(
            "seed_random", "boolean", True, "", "Accepted; random numbers come from the mission's seed."
        ),
        Parameter(
            "bhv_ipf",
            "choice",
            "auto",
            "",
            "Post functions as BHV_IPF: always (as MOOS-IvP), never, or only while somebody listens (auto).",
            choices=("auto", "always", "never"),
        ),
        Parameter(
            "accept_retired",
            "boolean",
            False,
            "",
            "Retired behaviours and parameters are warnings instead of errors. An addition of ours.",
        ),
    )
)


@dataclass(frozen=True)
class HelmSettings:
    """What the helm core goes by, from the bound block. `settle` is the time after start without decisions."""

    entries: tuple[DomainEntry, ...] = ()
    community: str = "ownship"
    start_in_drive: bool = False
    allow_park: bool = True
    park_on_allstop: bool = False
    ok_skew: float = 60.0
    hold_on_apps: tuple[str, ...] = ()
    nav_grace: float = 5.0
    nav_timeout: float = 0.0
    contact_max_age: float = 45.0
    contact_extrapolation: float = 0.0
    goals_mandatory: bool = False
    helm_prefix: str = ""
    helm_alias: str = ""
    other_override_var: str = ""
    standby: float = 0.0
    turn_model: TurnModel | None = None
    comms_policy: str = "open"
    accept_retired: bool = False
    settle: float = 1.0

    @classmethod
    def from_values(cls, values: Values, community: str) -> HelmSettings:
        """Settings from the bound parameters of `HELM_PARAMETERS`."""
        return cls(
            entries=tuple(values.domain),
            community=community,
            start_in_drive=values.start_in_drive,
            allow_park=values.allow_park,
            park_on_allstop=values.park_on_allstop,
            ok_skew=values.ok_skew,
            hold_on_apps=tuple(name for names in values.hold_on_apps for name in names),
            nav_grace=values.nav_grace,
            nav_timeout=values.nav_timeout,
            contact_max_age=values.contact_max_age,
            contact_extrapolation=values.contact_extrapolation,
            goals_mandatory=values.goals_mandatory,
            helm_prefix=values.helm_prefix,
            helm_alias=values.helm_alias,
            other_override_var=values.other_override_var,
            standby=values.standby,
            turn_model=values.pmgen,
            comms_policy=vars(values).get("comms_policy", "open"),
            accept_retired=values.accept_retired,
        )

    def domain(self) -> Domain | None:
        """The decision domain in file order, None if no line gives one.

        Raises:
            IvPError: a variable is given twice.
        """
        return Domain(entry.variable for entry in self.entries) if self.entries else None

    @property
    def mandatory(self) -> tuple[str, ...]:
        """Variables without which a decision is none."""
        return tuple(entry.variable.name for entry in self.entries if not entry.optional)
