"""A fleet that explores, samples and flees storms, moved as points: enough to see its opinions at work.

Eight engines (`OpinionEngine`, the real ones) exchange text messages within radio range while points move
between two zones as their options say (gcid.md 10 to 12, without vessels, behaviours or a helm). It feeds the
figures of `plots` in seconds; the bloom mission is the full thing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from opinion_engine.engine import EngineSettings, OpinionEngine
from opinion_engine.model import Attention, Floats
from opinion_engine.option_file import Option, OptionSet

NAMES = ("abe", "ben", "cal", "deb", "eve", "fin", "gil", "hix")
RANGE = 160.0  # m, radio
STORM_RADIUS = 180.0
SPEED = {"explore": 1.0, "exploit": 1.5, "migrate": 1.5}
ZONES = (
    np.array([(-321.4, -204.8), (-50.3, -76.3), (99.6, -392.6), (-192.9, -521.1)]),
    np.array([(114.3, -27.4), (383.4, 101.1), (535.3, -214.4), (242.8, -343.7)]),
)
ATTENTION = Attention(tau_u=4.0, u_min=0.5, u_max=2.0, y_th=2000.0, n=2.0)


@dataclass(frozen=True, eq=False)
class FleetHistory:
    """t (T,) in s; z (T, N, 3); u, degree (T, N): opinions, attention and vessels in range; option names."""

    t: Floats
    z: Floats
    u: Floats
    degree: Floats
    names: tuple[str, ...]
    options: tuple[str, ...]


def bloom_options(alpha: float = 1.0) -> OptionSet:
    """Explore, exploit and migrate with the couplings of gcid.md 11, in the paper's order.

    alpha is the self-reinforcement of the first two: 1.0 is what the reference runs with, 0.05 what it writes.
    """

    def option(
        name: str, a: float, beta: float, gamma: float, delta: dict[str, float], gain: float
    ) -> Option:
        return Option(
            name=name,
            outputs=(("OPTION", name.upper()),),
            input_variable=f"{name.upper()}_INPUT",
            function_type="none",
            social_mode="custom",
            resistance=0.25,
            alpha=a,
            beta=tuple((o, beta) for o in ("explore", "exploit", "migrate") if o != name),
            gamma=gamma,
            delta=tuple(delta.items()),
            input_min=-100.0,
            input_gain=gain,
        )

    return OptionSet(
        (
            option("explore", alpha, -0.01, -0.05, {"exploit": 0.01}, 1.0),
            option("exploit", alpha, -0.01, -0.05, {"explore": 0.01}, 1.0),
            option("migrate", 1.0, 0.0, 8.0, {}, 40.0),
        )
    )


def inside(zone: Floats, points: Floats) -> np.ndarray:
    """Which points (N, 2) lie in the convex polygon (K, 2), corners clockwise."""
    edge = np.roll(zone, -1, axis=0) - zone
    to = points[:, None, :] - zone[None]
    return np.all(edge[:, 0] * to[..., 1] - edge[:, 1] * to[..., 0] <= 0.0, axis=1)


class _Fleet:
    """Positions, tasks and inputs of the points; the engines decide."""

    def __init__(self, n: int, rng: np.random.Generator) -> None:
        self.rng, self.n = rng, n
        self.position = ZONES[0].mean(axis=0) + rng.normal(0.0, 60.0, (n, 2))
        self.zone = np.zeros(n, dtype=int)  # where each belongs
        self.goal = np.array([self.random_point(0) for _ in range(n)])
        self.samples = np.empty((0, 2))
        self.target = np.full(n, -1)  # the sample point assigned to each, -1 for none
        self.working = np.zeros(n)  # seconds spent on it
        self.battery = rng.uniform(0.0, 0.2, n)
        self.departed = np.full(n, -1e9)  # when the last migration began
        self.arrived = np.ones(n, dtype=bool)

    def random_point(self, zone: int) -> Floats:
        return np.asarray(self.rng.dirichlet(np.ones(4)) @ ZONES[zone])

    def assign(self) -> None:
        """A sample point belongs to the vessel nearest to it; each vessel goes to its nearest."""
        self.target[:] = -1
        if len(self.samples):
            distance = np.hypot(*(self.position[:, None] - self.samples[None]).transpose(2, 0, 1))
            mine = distance == distance.min(axis=0)
            nearest = np.where(mine, distance, np.inf).argmin(axis=1)
            self.target = np.where(mine.any(axis=1), nearest, -1)

    def inputs(self, storm: Floats | None, near: np.ndarray, now: float) -> Floats:
        """Raw inputs (N, 3) for explore, exploit and migrate (gcid.md 12)."""
        raw = np.zeros((self.n, 3))
        stormy = np.zeros(self.n, dtype=bool)
        if storm is not None:
            stormy = np.hypot(*(self.position - storm).T) < STORM_RADIUS
        has = self.target >= 0
        raw[:, 0] = 50.0 * self.battery + np.where(has | stormy, 0.0, 50.0)
        if has.any():
            way = np.hypot(*(self.position - self.samples[self.target]).T)
            raw[:, 1] = np.where(has, 50.0 * np.minimum(1.0, way / 150.0) + 50.0 * (self.working > 0), 0.0)
        since = now - self.departed
        circle = near | np.eye(self.n, dtype=bool)
        straggling = (circle & ~self.arrived[None, :]).any(axis=1)
        raw[:, 2] = 100.0 * stormy + 60.0 * (~self.arrived & straggling)
        resisting = ~stormy & self.arrived & (since < 600.0)
        raw[:, 2] -= np.where(resisting, 100.0 * (1.0 - since / 600.0), 0.0)
        return raw

    def move(self, choices: list[str], now: float, dt: float) -> None:
        done: list[int] = []
        for v, choice in enumerate(choices):
            if choice == "migrate" and now - self.departed[v] > 600.0:
                self.zone[v] = 1 - self.zone[v]
                self.departed[v] = now
                self.arrived[v] = False
                self.goal[v] = self.random_point(self.zone[v])
            sampling = choice == "exploit" and self.target[v] >= 0
            to = self.samples[self.target[v]] if sampling else self.goal[v]
            way = to - self.position[v]
            length = max(float(np.hypot(*way)), 1e-9)
            if sampling and length < 5.0:
                self.working[v] += dt
                if self.working[v] >= 20.0:
                    done.append(int(self.target[v]))
                    self.working[v] = 0.0
                continue
            self.working[v] = 0.0
            if length < 8.0:
                self.goal[v] = self.random_point(self.zone[v])
            step = min(SPEED[choice] * dt, length)
            self.position[v] += way / length * step
            self.battery[v] = min(1.0, self.battery[v] + step / 7200.0)
        self.samples = np.delete(self.samples, done, axis=0)
        for zone in (0, 1):
            there = (self.zone == zone) & ~self.arrived
            if there.any():
                self.arrived[there] = inside(ZONES[zone], self.position[there])

    @property
    def here(self) -> int:
        """The zone most vessels belong to."""
        return int(np.bincount(self.zone, minlength=2).argmax())


def fleet_story(seed: int = 1, minutes: float = 130.0, vessels: int = 8, alpha: float = 1.0) -> FleetHistory:
    """The opinions of a fleet over `minutes` of mission time: blooms to sample, two storms to flee."""
    rng = np.random.default_rng(seed)
    n = vessels
    names = NAMES[:n] if n <= len(NAMES) else tuple(f"v{k}" for k in range(n))
    options = bloom_options(alpha)
    engines = [OpinionEngine(name, options, EngineSettings(attention=ATTENTION), 0.0) for name in names]
    variables = [option.input_variable for option in options.options]
    fleet = _Fleet(n, rng)
    choices = ["explore"] * n
    ticks = round(60.0 * minutes)
    storms = [round(0.32 * ticks), round(0.72 * ticks)]
    times = np.arange(1, ticks + 1, dtype=float)
    z, u, degree = np.empty((ticks, n, 3)), np.empty((ticks, n)), np.empty((ticks, n))
    home = 0
    for tick, now in enumerate(times):
        if fleet.here != home:  # the sample points are left behind
            home, fleet.samples = fleet.here, np.empty((0, 2))
        if tick % 600 == 180:
            bloom = fleet.random_point(home) + rng.normal(0.0, 40.0, (5, 2))
            fleet.samples = np.vstack([fleet.samples, bloom])
        if tick in storms:
            struck = home
        began = next((s for s in storms if s <= tick < s + 600), None)
        drift = None if began is None else 0.75 * (tick - began) - 225.0
        storm = None if drift is None else ZONES[struck].mean(axis=0) + np.array([drift, 0.4 * drift])
        distances = np.hypot(*(fleet.position[:, None] - fleet.position[None]).transpose(2, 0, 1))
        near = (distances < RANGE) & ~np.eye(n, dtype=bool)
        fleet.assign()
        raw = fleet.inputs(storm, near, now)
        said = []
        for v, engine in enumerate(engines):
            for j, variable in enumerate(variables):
                engine.take(variable, float(raw[v, j]))
            update = engine.update(now)
            assert update is not None  # every option is always active here
            said.append(update.text)
            choices[v] = next((value.lower() for _, value in update.postings), choices[v])
            z[tick, v], u[tick, v] = update.z, update.u
        for v, engine in enumerate(engines):
            for k in np.nonzero(near[v])[0]:
                engine.receive(said[k], now)
        degree[tick] = near.sum(axis=1)
        fleet.move(choices, now, 1.0)
    return FleetHistory(times, z, u, degree, names, options.names)
