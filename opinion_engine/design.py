"""What a set of options will do, in words and numbers, for whoever writes an option file.

Theory where it is exact (relations, critical attention of every pattern, cascade thresholds), simulation of
the fleet's engines where it is not (which input makes one agent, or all, choose an option, and how soon), and
the traps of gcid.md 22 that these options run into.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np

from opinion_engine import analysis, graphs
from opinion_engine.graphs import Graph
from opinion_engine.messages import Z_MAX
from opinion_engine.model import Attention, Couplings, Floats, OpinionError, OpinionNetwork
from opinion_engine.option_file import OptionSet
from opinion_engine.population import Population

Topology = Literal["all", "line", "ring", "star"]
TOPOLOGIES: tuple[Topology, ...] = ("all", "line", "ring", "star")

_HORIZON = 300.0  # s of simulation after which an agent that has not chosen never will
_BISECTIONS = 24


@dataclass(frozen=True)
class Setting:
    """The fleet a set of options is meant for; attention and threshold as in `pOpinionManager`'s block.

    biases: raw inputs that every agent has at all times, by option name.
    """

    agents: int = 8
    topology: Topology = "all"
    attention: Attention = field(default_factory=Attention)
    opinion_thresh: float = 0.1
    social_tick: float = 1.0
    biases: tuple[tuple[str, float], ...] = ()

    def graph(self, topology: Topology | None = None) -> Graph:
        """Who hears whom. Raises OpinionError for fewer agents than the graph needs."""
        make = {
            "all": graphs.all_to_all,
            "line": graphs.line,
            "ring": graphs.ring,
            "star": graphs.star,
        }[topology or self.topology]
        if self.agents < 2:
            raise OpinionError(f"a fleet has at least 2 agents, not {self.agents}")
        return make(self.agents)


@dataclass(frozen=True, eq=False)
class Pattern:
    """A way in which the neutral fleet can break up: at attention u_star, along `options` (N_O,) and `agents`
    (N,).

    u_star None: never. alike is True when all agents lean the same way, False when neighbours differ.
    """

    u_star: float
    options: Floats
    agents: Floats

    @property
    def alike(self) -> bool:
        """Whether all agents lean the same way."""
        return bool(np.all(self.agents > -1e-9) or np.all(self.agents < 1e-9))


def patterns(couplings: Couplings, graph: Graph) -> list[Pattern]:
    """Every pattern that grows from neutral at some attention, by rising critical attention.

    For each eigenvalue of the (symmetric) graph, the real u > 0 at which -D + u (own + lambda heard) is
    singular on the zero-sum space.
    """
    values, vectors = np.linalg.eigh(graph.adjacency())
    basis = analysis.zero_sum_basis(couplings.n_options)
    damping = basis.T @ np.diag(couplings.resistance) @ basis
    found = []
    for position, value in enumerate(values):
        if position and abs(value - values[position - 1]) < 1e-9:
            continue  # the same patterns on another agent pattern of equal eigenvalue
        gain = basis.T @ (couplings.own + value * couplings.heard) @ basis
        rates, shapes = np.linalg.eig(np.linalg.solve(damping, gain))
        for rate, shape in zip(rates, shapes.T, strict=True):
            if abs(rate.imag) <= 1e-9 * abs(rate) and rate.real > 1e-12:
                direction = basis @ shape.real
                direction = direction / direction[np.argmax(np.abs(direction))]
                found.append(Pattern(1.0 / float(rate.real), direction, vectors[:, position]))
    return sorted(found, key=lambda p: p.u_star)


@dataclass(frozen=True)
class Reach:
    """What an input to one agent achieves: the least raw input that does it (None: not even the largest), and
    the seconds it takes at the largest input."""

    raw: float | None
    seconds: float | None


def reaches(
    options: OptionSet, setting: Setting, option: int, graph: Graph | None = None
) -> tuple[Reach, Reach]:
    """(one, all): what it takes for the agent with an input on `option` to choose it, and for all to do so.

    The agents start neutral and settle with the setting's biases for a while; then agent 0 (the end of a
    line, the hub of a star) gets the input on top.
    """
    graph = graph or setting.graph()
    chosen = options.options[option]
    highest = chosen.input_max
    bias = dict(setting.biases).get(chosen.name)
    lowest = chosen.input_min if bias is None else bias
    rest = _settled(options, setting, graph)
    full = _choose_times(options, setting, graph, rest, option, highest)
    results = []
    for who, reached in enumerate(full):
        if reached is None:
            results.append(Reach(None, None))
            continue
        low, high = lowest, highest
        if _choose_times(options, setting, graph, rest, option, low)[who] is not None:
            results.append(Reach(low, reached))
            continue
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if _choose_times(options, setting, graph, rest, option, middle)[who] is None:
                low = middle
            else:
                high = middle
        results.append(Reach(high, reached))
    return results[0], results[1]


def _bias_inputs(options: OptionSet, setting: Setting) -> Floats:
    """b (N, N_O) of the biases; an option without bias has had no input, which is b = 0."""
    biases = dict(setting.biases)
    row = [
        option.utility(biases[option.name]) if option.name in biases else 0.0 for option in options.options
    ]
    return np.tile(np.array(row), (setting.agents, 1))


def _settled(options: OptionSet, setting: Setting, graph: Graph) -> tuple[Floats, Floats]:
    population = Population(
        graph, options.couplings(), attention=setting.attention, inputs=_bias_inputs(options, setting)
    )
    if setting.biases:
        for _ in range(round(60.0 * setting.social_tick)):
            population.step(1.0 / setting.social_tick, "held")
    return population.z.copy(), population.u.copy()


def _choose_times(
    options: OptionSet, setting: Setting, graph: Graph, rest: tuple[Floats, Floats], option: int, raw: float
) -> tuple[float | None, float | None]:
    """Seconds until agent 0, and until all agents, have chosen `option` for good (None: never)."""
    b = _bias_inputs(options, setting)
    b[0, option] = options.options[option].utility(raw)
    population = Population(
        graph, options.couplings(), attention=setting.attention, inputs=b, z0=rest[0], u0=rest[1]
    )
    dt = 1.0 / setting.social_tick
    one: float | None = None
    every: float | None = None
    for _ in range(round(_HORIZON / dt)):
        population.step(dt, "held")
        z = population.z
        chose = (population.choices() == option) & (z[:, option] >= setting.opinion_thresh)
        one = (population.time if one is None else one) if chose[0] else None
        every = (population.time if every is None else every) if chose.all() else None
    return one, every


def relation(couplings: Couplings, j: int, other: int) -> str:
    """How two neighbours' opinions about option j and `other` bear on each other, from j's side (gcid.md 1)."""
    difference = couplings.heard[j, j] - couplings.heard[j, other]
    return "cooperative" if difference > 0.0 else "competitive" if difference < 0.0 else "indifferent"


def report(options: OptionSet, setting: Setting, model: str = "paper") -> str:
    """The whole text: options, relations, patterns, inputs, speed, traps."""
    unknown = [name for name, _ in setting.biases if name not in options.names]
    if unknown:
        raise OpinionError(f"there is no option '{unknown[0]}': the options are {', '.join(options.names)}")
    if len(options) < 2:
        raise OpinionError("a choice needs at least two options")
    couplings = options.couplings()
    if model == "reference":
        couplings = options.reference_couplings()
        options = _with_alpha_one(options)
    graph = setting.graph()
    lines = [*_head(options, setting, model), "", *_relations(options, couplings), ""]
    lines += [*_patterns(options, couplings, setting, graph), ""]
    lines += [*_inputs(options, setting, graph), ""]
    lines += _traps(options, couplings, setting, model)
    return "\n".join(lines)


def _with_alpha_one(options: OptionSet) -> OptionSet:
    return OptionSet(tuple(replace(option, alpha=1.0) for option in options.options), options.warnings)


def _head(options: OptionSet, setting: Setting, model: str) -> list[str]:
    a = setting.attention
    hearing = {"all": "all hear all", "line": "in a line", "ring": "in a ring", "star": "around a hub"}
    lines = [
        f"{setting.agents} agents, {hearing[setting.topology]}; model {model}; attention {a.u_min:g} to {a.u_max:g}, "
        f"half aroused at y = {a.y_th:g} (order {a.n:g}), time constant {a.tau_u:g} s",
    ]
    if setting.biases:
        lines.append("every agent has " + ", ".join(f"{name} = {raw:g}" for name, raw in setting.biases))
    width = max(len(name) for name in options.names)
    lines += [
        "",
        f"{'option':<{width}}  {'d':>6} {'alpha':>7} {'gamma':>7} {'b from':>8} {'to':>6}  betas and deltas",
    ]
    for option in options.options:
        low, high = option.utility(option.input_min), option.utility(option.input_max)
        if option.function_type == "quadratic":
            low = 0.0
        pairs = [f"beta {other} {value:g}" for other, value in option.beta if value]
        pairs += [f"delta {other} {value:g}" for other, value in option.delta if value]
        lines.append(
            f"{option.name:<{width}}  {option.resistance:>6g} {option.alpha:>7g} {option.gamma:>7g} {low:>8g} "
            f"{high:>6g}  {', '.join(pairs) or '-'}"
        )
    return lines


def _relations(options: OptionSet, couplings: Couplings) -> list[str]:
    lines = ["How neighbours' opinions bear on each other (gamma - delta, pair by pair):"]
    for j, other in combinations(range(len(options)), 2):
        names = options.names[j], options.names[other]
        sides = relation(couplings, j, other), relation(couplings, other, j)
        if sides[0] == sides[1]:
            lines.append(f"  {names[0]} and {names[1]}: {sides[0]}")
        else:
            lines.append(f"  {names[0]} and {names[1]}: {sides[0]} for {names[0]}, {sides[1]} for {names[1]}")
    return lines


def _patterns(options: OptionSet, couplings: Couplings, setting: Setting, graph: Graph) -> list[str]:
    a = setting.attention
    found = patterns(couplings, graph)
    lines = ["What grows by itself from neutral, without any input:"]
    if not found:
        return [*lines, "  nothing, at any attention: opinions only follow inputs"]
    shown: set[str] = set()
    for pattern in found:
        what = f"{_in_words(options, pattern.options)}, {'all agents alike' if pattern.alike else 'neighbours differ'}"
        if what in shown:
            continue  # the same in another arrangement of the agents, and later
        shown.add(what)
        if pattern.u_star <= a.u_min:
            verdict = "below u_min: at rest already; the neutral state cannot last"
        elif pattern.u_star <= a.u_max:
            verdict = "between u_min and u_max: once attention is aroused"
        else:
            verdict = "above u_max: never"
        lines.append(f"  {what}: from u* = {pattern.u_star:.4g}, {verdict}")
    fastest = found[0]
    basis = analysis.zero_sum_basis(len(options))
    damping = basis.T @ np.diag(couplings.resistance) @ basis
    slowest = 1.0 / float(np.linalg.eigvalsh(damping).min())
    lines.append(f"  without support an opinion fades with a time constant of {slowest:.3g} s")
    if fastest.u_star < a.u_max:
        rate = float(np.linalg.eigvalsh(damping).min()) * (a.u_max / fastest.u_star - 1.0)
        lines.append(
            f"  fully aroused, the first of these grows with a time constant of about {1.0 / rate:.3g} s"
        )
    return lines


def _in_words(options: OptionSet, direction: Floats) -> str:
    """`explore against exploit`: the options a pattern sets against each other."""
    large = np.abs(direction) > 0.25 * np.abs(direction).max()
    plus = [n for n, v, on in zip(options.names, direction, large, strict=True) if on and v > 0]
    minus = [n for n, v, on in zip(options.names, direction, large, strict=True) if on and v < 0]
    if len(plus) > 1 and len(minus) == 1:
        plus, minus = minus, plus
    return f"{' and '.join(plus) or 'nothing'} against {' and '.join(minus) or 'the rest'}"


def _inputs(options: OptionSet, setting: Setting, graph: Graph) -> list[str]:
    lines = [
        f"What a raw input to one agent does (others {'as above' if setting.biases else 'without input'}):"
    ]
    biases = dict(setting.biases)
    for j, option in enumerate(options.options):
        one, every = reaches(options, setting, j, graph)
        least = biases.get(option.name, option.input_min)
        if one.raw is None:
            lines.append(f"  {option.name}: not even {option.input_max:g} makes the agent choose it")
            continue
        text = f"  {option.name}: the agent {_from(options, j, one, least, 'chooses it')}"
        if every.raw is None:
            text += "; the fleet never follows"
        else:
            text += f"; the whole fleet {_from(options, j, every, least, 'does')}"
            if every.raw > least:
                text += f", after {every.seconds:.0f} s at full input"
        lines.append(text)
    network = OpinionNetwork.from_couplings(graph.adjacency(), options.couplings())
    for j, option in enumerate(options.options):
        push = np.zeros((setting.agents, len(options)))
        push[:, j] = 1.0
        highest = option.utility(option.input_max)
        found = analysis.cascade_threshold(network, setting.attention, push, b_most=3.0 * highest)
        if found is not None:
            verdict = "" if found.b_star <= highest else f", more than its input can give ({highest:g})"
            lines.append(
                f"  cascade into {option.name} with input at every agent: from b* = {found.b_star:.4g}{verdict}"
            )
    return lines


def _from(options: OptionSet, j: int, reach: Reach, least: float, does: str) -> str:
    assert reach.raw is not None
    if reach.raw <= least:
        return f"{does} anyway"
    return f"{does} from {reach.raw:.4g} (b = {options.options[j].utility(reach.raw):.4g})"


def _traps(options: OptionSet, couplings: Couplings, setting: Setting, model: str) -> list[str]:
    found = [str(warning) for warning in options.warnings]
    found += _file_traps(options)
    found += _size_traps(options, setting)
    if setting.topology == "all" and setting.agents > 2:
        found += _line_trap(options, setting)
    if model == "paper":
        found += _reference_traps(options, setting)
    rate = float((couplings.resistance + setting.attention.u_max * np.abs(couplings.own).sum(axis=1)).max())
    if model == "reference" and rate >= 2.0 * setting.social_tick:
        found.append(
            f"one Euler step per update is unstable here: rate {rate:.3g}/s at {setting.social_tick:g} Hz"
        )
    return ["Traps:", *(f"  - {text}" for text in found)] if found else ["No trap found."]


def _file_traps(options: OptionSet) -> list[str]:
    found = []
    offset = [o.name for o in options.options if abs(o.utility(0.0)) > 1e-9 and o.function_type == "none"]
    if offset:
        text = f"raw input 0 is not neutral for {', '.join(offset)}: its range is not centred on 0"
        examples = {o.name: o.utility(0.0) for o in options.options}
        found.append(f"{text} (b = {examples[offset[0]]:g}; no input received yet means b = 0)")
    seen: dict[tuple[tuple[str, str], ...], str] = {}
    for option in options.options:
        if option.outputs in seen:
            found.append(f"{option.name} and {seen[option.outputs]} post the same outputs")
        seen[option.outputs] = option.name
    variables = [{variable for variable, _ in option.outputs} for option in options.options]
    for option, own in zip(options.options, variables, strict=True):
        missing = set.union(*variables) - own
        if missing:
            text = f"{option.name} does not set {', '.join(sorted(missing))}"
            found.append(f"{text}: outputs are latched, so another option's value stays")
    return found


def _size_traps(options: OptionSet, setting: Setting) -> list[str]:
    found = []
    a, n_o = setting.attention, len(options)
    gains = [abs(o.input_gain) for o in options.options]
    for option, gain in zip(options.options, gains, strict=True):
        most = (1.0 - 1.0 / n_o) * (gain + a.u_max * n_o) / option.resistance
        if most < setting.opinion_thresh:
            found.append(
                f"{option.name} can never reach opinion_thresh {setting.opinion_thresh:g}: with resistance "
                f"{option.resistance:g} its opinion stays below {most:.3g}"
            )
    top = max((g + a.u_max * n_o) / o.resistance for o, g in zip(options.options, gains, strict=True))
    if (1.0 - 1.0 / n_o) * top > Z_MAX:
        found.append(f"opinions may exceed {Z_MAX:g}, where the i8 and i16 message forms stop")
    if max(gains) > 10.0 * min(gains):
        text = f"gains from {min(gains):g} to {max(gains):g} give opinions of two scales"
        found.append(f"{text}; y_th = {a.y_th:g} tells which of them arouses attention")
    largest = max((1.0 - 1.0 / n_o) * g / o.resistance for o, g in zip(options.options, gains, strict=True))
    if largest**2 / n_o < 0.1 * a.y_th:
        found.append(
            f"y_th = {a.y_th:g} is far above what any input alone gives (about {largest**2 / n_o:.3g})"
        )
    return found


def _line_trap(options: OptionSet, setting: Setting) -> list[str]:
    """Options that take the whole fleet when all hear all, but not along a line."""
    found = []
    line = replace(setting, topology="line")
    for j, option in enumerate(options.options):
        everywhere = reaches_at_full(options, setting, j)
        if everywhere and not reaches_at_full(options, line, j):
            found.append(
                f"{option.name} spreads through the fleet when all hear all, but not along a line of "
                f"{setting.agents}: give it an input of its own at agents that already follow"
            )
    return found


def reaches_at_full(options: OptionSet, setting: Setting, option: int) -> bool:
    """Whether the largest input at one agent makes all agents choose the option."""
    graph = setting.graph()
    rest = _settled(options, setting, graph)
    times = _choose_times(options, setting, graph, rest, option, options.options[option].input_max)
    return times[1] is not None


def _reference_traps(options: OptionSet, setting: Setting) -> list[str]:
    found = []
    different = [o.name for o in options.options if o.alpha != 1.0]
    if different:
        here = patterns(options.couplings(), setting.graph())
        there = patterns(options.reference_couplings(), setting.graph())
        text = f"the reference ignores alpha of {', '.join(different)} and takes 1"
        if here and there:
            text += f"; the lowest u* would be {there[0].u_star:.4g} instead of {here[0].u_star:.4g}"
            before, after = (sum(p.u_star <= setting.attention.u_max for p in ps) for ps in (here, there))
            if before != after:
                text += f", and {after} patterns instead of {before} could grow"
        found.append(text)
    dropped = [
        f"{o.name} for {other}"
        for o in options.options
        for other, v in o.delta
        if v and other not in dict(o.beta)
    ]
    if dropped:
        found.append(f"the reference drops a delta without a beta for the same option: {', '.join(dropped)}")
    return found


def biases_from(texts: Mapping[str, str]) -> tuple[tuple[str, float], ...]:
    """Biases from NAME -> number texts. Raises OpinionError for what is no number."""
    found = []
    for name, text in texts.items():
        try:
            value = float(text)
        except ValueError:
            raise OpinionError(f"bias {name} = {text!r} is not a number") from None
        if not np.isfinite(value):
            raise OpinionError(f"bias {name} = {text!r} is not a finite number")
        found.append((name.lower(), value))
    return tuple(found)
