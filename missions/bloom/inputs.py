"""The inputs of the three options: how much a vessel wants to explore, to exploit, to migrate (gcid.md 12).

Raw inputs, on the scale of the option file (-100 to 100). Functions of plain numbers; metres, seconds, volts.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

from mypy_extensions import mypyc_attr

FULL_BATTERY_WAY = 7200.0
"""Metres of way that empty a battery nobody measures."""
SETTLING = 2.0
"""Seconds after a migration before the reluctance to go again begins to count."""


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class InputSettings:
    """Weights of the inputs; the names are those of the app's parameters."""

    max_batt: float = 15.5
    min_batt: float = 11.5
    batt_input_gain: float = 50.0
    battery_lag: float = 10.0
    no_sample_available_weight: float = 50.0
    currently_sampling_weight: float = 50.0
    sample_input: float = 50.0
    sample_near: float = 0.0
    sample_far: float = 150.0
    storm_detected_input: float = 100.0
    finish_migration_input: float = 60.0
    migration_pause: float = 300.0
    migration_resistance: float = -100.0
    no_samples_patience: float = 60.0
    no_samples_slope: float = 0.1


class Battery:
    """How exhausted the battery is, 0 to 1: measured, or by the way made; low-pass filtered."""

    def __init__(self, settings: InputSettings) -> None:
        self._settings = settings
        self.volts: float | None = None
        self.exhaustion: float | None = None
        self._at = 0.0

    def update(self, odometer: float, now: float) -> float:
        """Exhaustion at `now`, after `odometer` metres."""
        s = self._settings
        span = s.max_batt - s.min_batt
        volts = s.max_batt - span * odometer / FULL_BATTERY_WAY if self.volts is None else self.volts
        raw = min(1.0, max(0.0, (s.max_batt - volts) / span))
        if self.exhaustion is None or s.battery_lag <= 0.0:
            self.exhaustion = raw
        else:
            self.exhaustion += (1.0 - exp(-(now - self._at) / s.battery_lag)) * (raw - self.exhaustion)
        self._at = now
        return self.exhaustion


def explore_input(s: InputSettings, exhaustion: float, sample_available: bool, storm: bool) -> float:
    """g1: a tired vessel prefers slow searching, and so does one that knows nothing to sample."""
    idle = 0.0 if sample_available or storm else s.no_sample_available_weight
    return s.batt_input_gain * exhaustion + idle


def exploit_input(s: InputSettings, distance: float | None, sampling: bool) -> float:
    """g2: grows with the distance in metres to the sample point that is mine, None if none is."""
    wanted = 0.0
    if distance is not None:
        share = (distance - s.sample_near) / (s.sample_far - s.sample_near)
        wanted = s.sample_input * min(1.0, max(0.0, share))
    return wanted + (s.currently_sampling_weight if sampling else 0.0)


def migrate_input(
    s: InputSettings, storm: bool, unfinished: bool, since_migration: float, without_samples: float
) -> float:
    """g3: storms and unfinished migrations call for it, a recent one speaks against another.

    unfinished        a migration is under way and somebody is not there yet
    since_migration   seconds since the last one was completed (or since the start)
    without_samples   seconds during which no sample point was available
    """
    total = s.storm_detected_input if storm else 0.0
    if unfinished:
        total += s.finish_migration_input
    if not storm and SETTLING < since_migration < s.migration_pause:
        total += s.migration_resistance * (1.0 - since_migration / s.migration_pause)
    if without_samples > s.no_samples_patience:
        total += s.no_samples_slope * (without_samples - s.no_samples_patience)
    return total
