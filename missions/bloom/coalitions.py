"""Coalitions that are given instead of chosen: who always exploits, who always explores (gcid.md 17, 18)."""

from __future__ import annotations

from pymoos_lite.config.parameters import Parameter, Values


def names_in(text: str) -> list[str]:
    """Names of a comma list, blanks dropped."""
    return [name for name in (part.strip() for part in text.split(",")) if name]


def fleet_names(text: str) -> list[str]:
    """Names of a colon list, as the macro VNAMES has them."""
    return [name for name in (part.strip() for part in text.split(":")) if name]


SET_PARAMETERS = (
    Parameter("persistent_exploit_set", "custom", None, "", "Vessels that always exploit; giving any set fixes the "
              "coalitions.", parse=names_in, example="abe, cal"),
    Parameter("persistent_explore_set", "custom", None, "", "Vessels that always explore.", parse=names_in,
              example="ben, deb"),
    Parameter("alternate_sets", "custom", None, "", "The whole fleet: its first vessel always exploits, the second "
              "explores, and so on.", parse=fleet_names, example="abe:ben:cal:deb"),
)  # fmt: skip


def given_sets(config: Values) -> tuple[frozenset[str], frozenset[str]]:
    """The exploit and the explore set that `SET_PARAMETERS` ask for, names in lower case."""
    exploit = [*(config.persistent_exploit_set or ()), *(config.alternate_sets or ())[0::2]]
    explore = [*(config.persistent_explore_set or ()), *(config.alternate_sets or ())[1::2]]
    return frozenset(name.lower() for name in exploit), frozenset(name.lower() for name in explore)
