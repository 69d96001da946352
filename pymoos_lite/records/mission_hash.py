"""MISSION_HASH: the name of a mission that people can say, like `241103-0834K-FOXY-WEED` (community.md 17)."""

from __future__ import annotations

import random
import time
from dataclasses import dataclass

from pymoos_lite.records.csp import RecordError, clip, field_map

_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_ADJECTIVES = """
ABLE AGED AVID BALD BOLD BUSY CALM COLD COOL CURT DAMP DARK DEEP DULL EASY EVEN FAIR FAST FINE FIRM FOND FOXY
FREE FULL GLAD GOLD GOOD GRAY HALE HARD HIGH HUGE IDLE JUST KEEN KIND LATE LAZY LEAN LONG LOUD LUSH MEEK MILD
NEAT NICE OPEN PALE PINK POSH PURE RARE REAL RICH RIPE SAFE SLIM SLOW SOFT SOUR TALL TAME TART TIDY TINY TRUE
VAST WARM WARY WEAK WIDE WILD WISE ZANY
"""
_NOUNS = """
ANTS BARN BEAR BELL BIRD BOAT BUOY CAKE CAVE CLAM COAT COVE CRAB CREW CROW DAWN DECK DOCK DOOR DOVE DUCK DUNE
FERN FISH FLAG FOAM FROG GALE GOAT GULL GULF HAND HARE HAWK HEAD HILL HOOK HORN HULL IRIS KEEL KELP KITE KNOT
LAKE LAMP LARK LEAF LION LYNX MAST MOLE MOON MOSS MOTH NEST OARS OATS PARK PEAR PIER PINE POND POOL PORT RAIN
REEF ROCK ROPE ROSE SAIL SAND SEAL SHIP SNOW SOAP STAR SWAN TERN TIDE TOAD TREE VEST WAVE WEED WIND WOLF WREN
"""
ADJECTIVES = tuple(_ADJECTIVES.split())
NOUNS = tuple(_NOUNS.split())


@dataclass(frozen=True, slots=True)
class MissionHash:
    """`full` like `241103-0834K-FOXY-WEED`; `utc` in unix seconds, never warped."""

    full: str
    utc: float

    @property
    def short(self) -> str:
        """The two words."""
        return "-".join(self.full.split("-")[-2:])

    def to_text(self) -> str:
        return f"mhash={self.full},utc={self.utc:.2f}"

    @classmethod
    def parse(cls, text: str) -> MissionHash:
        """Record from text; raises RecordError."""
        found = field_map("MISSION_HASH", text)
        try:
            return cls(found["mhash"], float(found.get("utc", "0")))
        except (KeyError, ValueError):
            raise RecordError(
                "MISSION_HASH", f"expected mhash=NAME,utc=SECONDS, found '{clip(text)}'"
            ) from None


def make_hash(unix_time: float, source: random.Random, *, utc: bool = False) -> MissionHash:
    """A new name: date and time (local unless `utc`), a random letter, an adjective and a noun of four letters."""
    at = time.gmtime(unix_time) if utc else time.localtime(unix_time)
    words = f"{source.choice(_LETTERS)}-{source.choice(ADJECTIVES)}-{source.choice(NOUNS)}"
    return MissionHash(f"{time.strftime('%y%m%d-%H%M', at)}{words}", unix_time)
