"""What a set of options will do, in words and numbers, for whoever writes an option file.

The numbers are those of `reach` and `analysis`, the warnings those of `traps`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from opinion_engine import analysis
from opinion_engine.graphs import Graph
from opinion_engine.model import Couplings, Floats, OpinionError, OpinionNetwork
from opinion_engine.option_file import OptionSet
from opinion_engine.reach import Reach, Setting, patterns, reaches, relation
from opinion_engine.traps import traps


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
    found = traps(options, couplings, setting, model)
    lines += ["Traps:", *(f"  - {text}" for text in found)] if found else ["No trap found."]
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
