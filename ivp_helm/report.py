"""What a helm shows a person: the body of its app cast (helm.md 13)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ivp_helm.lifecycle import Life, Outcome
from pymoos_lite.geometry.text import num

if TYPE_CHECKING:
    from ivp_helm.helm import HelmCore

MAX_POSTS_SHOWN = 30


def report_lines(core: HelmCore, comms_policy: str = "open") -> Iterator[str]:
    """Decision, behaviours by state with the reason for it, and the latest posts."""
    trace = core.trace
    now = core.buffer.now
    yield f"  Helm State: {core.authority.state}   Comms Policy: {comms_policy}"
    if trace is None:
        yield "  no iteration in DRIVE yet"
        if core.problems:
            yield from (f"  {problem}" for problem in core.problems)
        return
    rounds = trace.rounds
    functions = [outcome.function for _, outcome in rounds if outcome.function is not None]
    timing = core.timing
    yield f"  Helm Iteration: {trace.iteration}   IvP Functions: {len(functions)}"
    yield f"  Mode(s): {trace.modes}"
    yield (
        f"  SolveTime: {timing.solve:.4f} (max={timing.max_solve:.4f})"
        f"   CreateTime: {timing.create:.4f} (max={timing.max_create:.4f})"
        f"   LoopTime: {timing.create + timing.solve:.4f} (max={timing.max_loop:.4f})"
    )
    yield f"  Halted: {'true' if trace.reason == 'BehaviorError' else 'false'} ({core.warning_count} warnings)"
    yield f"  AllStop: {trace.reason}"
    yield "  Helm Decision: " + " ".join(f"[{part}]" for part in str(core.domain).split(":"))
    for name in core.domain.names:
        shown = num(trace.decision[name], 3) if name in trace.decision else "no-decision"
        yield f"    {name} = {shown}"
    if core.population.templates:
        shown = ", ".join(
            f"{t.block.kind}::{t.prefix} (Spawned:{t.made}/{t.tried})" for t in core.population.templates
        )
        yield f"  Behaviors Spawnable: {shown}"
    for title in ("active", "running", "disabled", "idle"):
        group = [(life, outcome) for life, outcome in rounds if outcome.state == title]
        yield f"  Behaviors {title.capitalize()}: ---------- ({len(group)})"
        for life, outcome in group:
            yield f"    {_behavior_line(life, outcome, now)}"
    completed = core.population.completed
    yield f"  Behaviors Completed: ------- ({core.population.completed_count})"
    if completed:
        yield "    " + ", ".join(f"{name} [{now - when:.1f}]" for name, when in reversed(completed))
    holding = [name for name in core.settings.hold_on_apps if name not in core.inbox.clients]
    if core.settings.hold_on_apps:
        yield f"  Hold-On-Apps: {', '.join(holding) if holding else 'all present'}"
    yield ""
    yield f"  {'Variable':<24} {'Behavior':<20} {'Time':>9} {'Iter':>7}  Value"
    latest = sorted(core.outbox.newest(), key=lambda post: (-post.time, post.variable))
    for post in latest[:MAX_POSTS_SHOWN]:
        value = num(post.value, 4) if isinstance(post.value, float) else str(post.value)
        yield (
            f"  {post.variable:<24} {post.behavior:<20} {post.time - core.started:>9.2f}"
            f" {post.iteration:>7}  {value[:60]}"
        )


def _behavior_line(life: Life, outcome: Outcome, now: float) -> str:
    since = f"[{now - life.entered:.1f}]" if life.entered > 0 else "[always]"
    text = f"{life.name} {since}"
    if outcome.function is not None:
        text += (
            f" (pwt={num(outcome.function.weight, 2)}) (pcs={outcome.function.pieces})"
            f" (cpu={outcome.build_seconds:.4f})"
        )
    if life.counts != "n/a":
        text += f" (upd={life.counts})"
    if outcome.blocked:
        text += f"  because not: {outcome.blocked}"
    elif life.behavior.why and outcome.state in ("active", "running"):
        text += f"  {life.behavior.why}"
    return text
