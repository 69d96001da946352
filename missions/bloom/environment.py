"""The world of the mission: blooms that grow and fade, storms that cross it (gcid.md 16).

Everything is drawn from the seed alone, blooms and storms from generators of their own, so that whatever
the vessels do, the same seed brings the same blooms and storms. Time is seconds since the start, and
chances are per second, however often `advance` is called.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import floor, hypot

from pymoos_lite.geometry.angles import project_point
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY
from pymoos_lite.geometry.voronoi import cut

FIRST_ZONE_SHARE = 0.49
"""Chance of the first zone; the second has the rest."""
PLACING_TRIES = 11
STORM_HEADINGS = (334.0, 154.0)
DRAWS_TRIED = 10000
STORM_LABEL = "storm"
"""Label of the storm's circle; those of blooms are Bloom_1, Bloom_2 ..."""


@dataclass(frozen=True)
class StormTrack:
    """A storm that comes at a given time: its centre passes (x, y), moving along `course` degrees."""

    time: float
    x: float
    y: float
    course: float


@dataclass(frozen=True)
class EnvironmentSettings:
    """Sizes in metres, times in seconds, angles in degrees.

    Raises:
        ValueError: limits out of order, or a zone too small for blooms of that size.
    """

    zones: tuple[Polygon, Polygon]
    storm_region: Polygon
    bloom_radius: tuple[float, float] = (25.0, 50.0)
    bloom_duration: tuple[float, float] = (600.0, 600.0)
    bloom_growth: str = "linear"
    bloom_max_speed: float = 0.0
    bloom_chance: float = 0.1
    time_between_blooms: float = 90.0
    first_zone_only: bool = False
    allow_storms: bool = True
    storm_radius: float = 180.0
    storm_speed: float = 0.75
    storm_max_angle: float = 2.0
    time_between_storms: float = 1800.0
    storm_tracks: tuple[StormTrack, ...] = ()
    """Storms at given times instead of drawn ones."""

    def __post_init__(self) -> None:
        for name in ("bloom_radius", "bloom_duration"):
            low, high = getattr(self, name)
            if not 0.0 < low <= high:
                raise ValueError(f"{name} from {low:g} to {high:g}: expected 0 < least <= most")
        if self.storm_speed <= 0.0:
            raise ValueError(f"storm_speed is {self.storm_speed:g}, expected more than 0")
        for zone in self.zones:
            if shrunk(zone, self.bloom_radius[1]) is None:
                raise ValueError(f"a zone is too small for blooms of {self.bloom_radius[1]:g} m radius")


@dataclass
class Bloom:
    """One bloom; `detected` and `sampled` are what vessels have done to it."""

    number: int
    x: float
    y: float
    full_radius: float
    start: float
    duration: float
    grows: bool
    velocity: XY = (0.0, 0.0)
    radius: float = 0.0
    detected: bool = False
    sampled: bool = False

    @property
    def label(self) -> str:
        return f"Bloom_{self.number}"

    def update(self, t: float) -> None:
        """Grow up to time `t`."""
        share = min(1.0, (t - self.start) / self.duration) if self.grows else 1.0
        self.radius = share * self.full_radius

    def contains(self, x: float, y: float) -> bool:
        return hypot(x - self.x, y - self.y) <= self.radius


@dataclass
class Storm:
    """One storm; it moves along `course` from where it began."""

    number: int
    x0: float
    y0: float
    course: float
    radius: float
    speed: float
    start: float
    end: float
    x: float = 0.0
    y: float = 0.0

    def update(self, t: float) -> None:
        self.x, self.y = project_point(self.course, self.speed * (t - self.start), self.x0, self.y0)

    def contains(self, x: float, y: float) -> bool:
        return hypot(x - self.x, y - self.y) <= self.radius


@dataclass
class Tally:
    """Blooms that are over, each counted once."""

    sampled: int = 0
    detected: int = 0
    missed: int = 0


def shrunk(polygon: Polygon, distance: float) -> Polygon | None:
    """A convex polygon with every edge moved inward by `distance`; None when nothing is left."""
    points = list(polygon.points)
    for nx, ny, c in polygon.half_planes:
        points = cut(points, nx, ny, c - distance)
    inner = Polygon(tuple(points))
    return inner if len(points) >= 3 and inner.area > 0.0 else None


def draw_point(polygon: Polygon, dice: random.Random) -> XY:
    """A place in a convex polygon, all equally likely."""
    x0, y0, x1, y1 = polygon.bounds
    for _ in range(DRAWS_TRIED):
        x, y = dice.uniform(x0, x1), dice.uniform(y0, y1)
        if polygon.contains(x, y):
            return x, y
    return polygon.area_centroid


@dataclass
class Environment:
    """Blooms and storms as time goes by; see the module."""

    settings: EnvironmentSettings
    seed: int | str = 0
    blooms: list[Bloom] = field(default_factory=list)
    storm: Storm | None = None
    tally: Tally = field(default_factory=Tally)
    expired: list[Bloom] = field(default_factory=list)
    """Blooms that ended in the last `advance`."""

    def __post_init__(self) -> None:
        self._bloom_dice = random.Random(f"{self.seed}:blooms")
        self._storm_dice = random.Random(f"{self.seed}:storms")
        largest = self.settings.bloom_radius[1]
        self._places: list[Polygon] = [shrunk(zone, largest) or zone for zone in self.settings.zones]
        self._second = 0
        self._count = 0
        self._storms = 0
        self._last_bloom = 0.0
        self._last_storm = 0.0
        self._tracks = sorted(self.settings.storm_tracks, key=lambda track: track.time)
        self.now = 0.0

    def advance(self, t: float) -> None:
        """Go on to time `t`; going back does nothing."""
        self.expired = []
        while self._second + 1 <= floor(t):
            self._second += 1
            self._end_blooms(float(self._second))
            self._roll_bloom(float(self._second))
            if self.settings.allow_storms:
                self._step_storm(float(self._second))
        self.now = max(t, self.now)
        for bloom in self.blooms:
            bloom.update(self.now)
        if self.storm is not None:
            self.storm.update(self.now)

    # --- blooms ------------------------------------------------------------------------------

    def _end_blooms(self, t: float) -> None:
        for bloom in [b for b in self.blooms if t - b.start >= b.duration]:
            self.blooms.remove(bloom)
            self.expired.append(bloom)
            if bloom.sampled:
                self.tally.sampled += 1
            elif bloom.detected:
                self.tally.detected += 1
            else:
                self.tally.missed += 1
        for bloom in self.blooms:
            vx, vy = bloom.velocity
            bloom.x += vx
            bloom.y += vy

    def _roll_bloom(self, t: float) -> None:
        s, dice = self.settings, self._bloom_dice
        if t - self._last_bloom < s.time_between_blooms or dice.random() >= s.bloom_chance:
            return
        first = dice.random() < FIRST_ZONE_SHARE
        zone = self._places[0 if first or s.first_zone_only else 1]
        radius, duration = dice.uniform(*s.bloom_radius), dice.uniform(*s.bloom_duration)
        fast = s.bloom_max_speed
        velocity = dice.uniform(-fast, fast), dice.uniform(-fast, fast)
        for _ in range(PLACING_TRIES):
            x, y = draw_point(zone, dice)
            if all(hypot(x - b.x, y - b.y) >= radius + b.full_radius for b in self.blooms):
                break
        else:
            return
        self._count += 1
        self._last_bloom = t
        grows = s.bloom_growth == "linear"
        self.blooms.append(Bloom(self._count, x, y, radius, t, duration, grows, velocity))

    # --- storms ------------------------------------------------------------------------------

    def _step_storm(self, t: float) -> None:
        if self.storm is not None:
            if t < self.storm.end:
                return
            self.storm = None
            self._last_storm = t
        if self.settings.storm_tracks:
            while self._tracks and self._tracks[0].time <= t:
                track = self._tracks.pop(0)
                self._begin_storm(t, (track.x, track.y), track.course)
        elif t - self._last_storm >= self.settings.time_between_storms:
            s, dice = self.settings, self._storm_dice
            zone = s.zones[0 if dice.random() < FIRST_ZONE_SHARE else 1]
            through = draw_point(zone, dice)
            heading = dice.choice(STORM_HEADINGS) + dice.uniform(-s.storm_max_angle, s.storm_max_angle)
            self._begin_storm(t, through, heading + 180.0)

    def _begin_storm(self, t: float, through: XY, course: float) -> None:
        """A storm that enters the storm region now, and leaves it on the far side of `through`."""
        s = self.settings
        before = s.storm_region.ray_dist(*through, course + 180.0)
        after = s.storm_region.ray_dist(*through, course)
        if before < 0.0 or after < 0.0:
            return
        x0, y0 = project_point(course + 180.0, before, *through)
        end = t + (before + after) / s.storm_speed
        self._storms += 1
        self.storm = Storm(self._storms, x0, y0, course % 360.0, s.storm_radius, s.storm_speed, t, end)
        self.storm.update(t)

    # --- what vessels do ---------------------------------------------------------------------

    def detect(self, x: float, y: float) -> bool:
        """Whether a vessel at (x, y) is in a bloom; each bloom it is in counts as detected."""
        found = False
        for bloom in self.blooms:
            if bloom.contains(x, y):
                bloom.detected = found = True
        return found

    def sample(self, x: float, y: float) -> Bloom | None:
        """The first bloom around (x, y) that was not sampled yet, sampled now; None if there is none."""
        for bloom in self.blooms:
            if not bloom.sampled and bloom.contains(x, y):
                bloom.sampled = bloom.detected = True
                return bloom
        return None

    def measure(self, x: float, y: float, decay: float = 1.0) -> float:
        """The sensor's reading: 1 in a bloom, less the further from the nearest one, 0 without any."""
        return max((_reading(bloom, x, y, decay) for bloom in self.blooms), default=0.0)

    def in_storm(self, x: float, y: float) -> bool:
        return self.storm is not None and self.storm.contains(x, y)


def _reading(bloom: Bloom, x: float, y: float, decay: float) -> float:
    outside = hypot(x - bloom.x, y - bloom.y) - bloom.radius
    return 1.0 if outside <= 0.0 else 1.0 / (decay * (outside + 1.0))


def exploring_share(options: Iterable[str]) -> float | None:
    """Share of EXPLORE among the vessels' options, in any case; None without vessels."""
    words: Sequence[str] = [option.lower() for option in options]
    return sum(word == "explore" for word in words) / len(words) if words else None
