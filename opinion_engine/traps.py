"""The traps of gcid.md 22 that a set of options runs into, one sentence each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from opinion_engine.messages import Z_MAX
from opinion_engine.model import Couplings
from opinion_engine.option_file import OptionSet
from opinion_engine.reach import Setting, patterns, reaches_at_full


def traps(options: OptionSet, couplings: Couplings, setting: Setting, model: str) -> list[str]:
    """Every trap that these options, for this fleet and model variant, run into."""
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
    return found


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
