"""Objective functions as posts: BHV_IPF packets that viewers and log tools read (helm.md 10.6)."""

from __future__ import annotations

from collections.abc import Sequence

from ivp_helm.ivp.codec import encode
from ivp_helm.ivp.packets import split_packets
from ivp_helm.lifecycle import Life, Outcome
from ivp_helm.outbox import Outbox


def post_functions(outbox: Outbox, rounds: Sequence[tuple[Life, Outcome]], iteration: int) -> None:
    """Every function of this iteration, cut into packets."""
    for life, outcome in rounds:
        if outcome.function is not None:
            text = encode(outcome.function.labelled(f"{iteration}:{life.name}"))
            for packet in split_packets(text, f"{life.name}^{iteration}"):
                outbox.post("BHV_IPF", packet, life.name)


def post_reasons(outbox: Outbox, rounds: Sequence[tuple[Life, Outcome]]) -> None:
    """Why each behaviour is where it is, when that changes: the condition that failed, or what it says of itself
    (`Behavior.why`). An addition of ours."""
    for life, outcome in rounds:
        why = outcome.blocked or (life.behavior.why if outcome.state in ("active", "running") else "")
        if why != life.told_why:
            life.told_why = why
            outbox.post("BHV_WHY", f"name={life.name},why={why}", life.name)
