"""The macros that every behaviour's flags know (helm.md 4.3)."""

from __future__ import annotations

import string
from typing import TYPE_CHECKING

from ivp_helm.flags import Flag

if TYPE_CHECKING:
    from ivp_helm.behavior import Behavior

_ALPHABET = (string.digits + string.ascii_letters).replace("o", "").replace("O", "")
_COUNTERS = ("CTR", "CTR1", "CTR2", "CTR3", "CTR4", "CTR5")
_HASHES = {"HASH": 6, **{f"HASH{n}": n for n in range(2, 10)}}


class Counters:
    """What `CTR`, `CTR1` ... and `NOW` remember from posting to posting."""

    def __init__(self) -> None:
        self.values = dict.fromkeys(_COUNTERS, 0)
        self.zero: float | None = None
        """When `NOW` was first asked for."""

    def count(self, flag: Flag) -> None:
        """A flag is about to be posted: each counter that it holds as ``$[CTR]`` moves on by one."""
        for name in {macro.name for macro in flag.macros if macro.bracket}:
            if name in self.values:
                self.values[name] += 1


def base_macro(behavior: Behavior, name: str) -> float | str | None:
    """The value of a macro that all behaviours have, None if there is none of that name."""
    counters = behavior.counters
    if name in counters.values:
        return float(counters.values[name])
    if name in _HASHES:
        return "".join(behavior.surroundings.random.choices(_ALPHABET, k=_HASHES[name]))
    if name == "NOW":
        if counters.zero is None:
            counters.zero = behavior.now
        return behavior.now - counters.zero
    own = behavior.surroundings.own
    values: dict[str, float | str] = {
        "OWNSHIP": behavior.community,
        "BHVNAME": behavior.name,
        "BHVTYPE": type(behavior).BHV_NAME,
        "PWT": behavior.pwt,
        "CONTACT": str(vars(behavior.config).get("contact", "")),
        "UTC": behavior.now,
        "OSX": own.x if own else 0.0,
        "OSY": own.y if own else 0.0,
        "OSH": own.heading if own else 0.0,
        "OSV": own.speed if own else 0.0,
        "DUR_RUN_TIME": behavior.run_time,
        "DUR_IDLE_TIME": behavior.idle_time,
    }
    return values.get(name)
