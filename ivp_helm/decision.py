"""From what the behaviours want to one decision: checks, the solver, and what went wrong (helm.md 9.4)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ivp_helm.ivp import Domain, IvPError, Solution, decision_domain, solve
from ivp_helm.lifecycle import Life, Outcome


class Verdict(NamedTuple):
    """The answer to an iteration. `complaint` is the halt message when something is wrong; there is no
    decision then."""

    decision: dict[str, float]
    solution: Solution | None = None
    complaint: str = ""


def decide(domain: Domain, rounds: Sequence[tuple[Life, Outcome]]) -> Verdict:
    """The best point for the functions of this round, over the variables that somebody wants decided."""
    functions = []
    for life, outcome in rounds:
        if outcome.failed:
            return Verdict({}, None, f"BHV_ERROR: {life.behavior.last_error}")
        if outcome.function is not None:
            functions.append(outcome.function)
    if not functions:
        return Verdict({})
    for function in functions:
        if function.domain is not domain:
            for name in function.domain.names:
                if name not in domain:
                    return Verdict({}, None, f"DomainVar {name} not recognized ")
    try:
        solution = solve(decision_domain(domain, functions), functions)
    except IvPError as error:
        return Verdict({}, None, str(error))
    return Verdict(solution.as_dict(), solution)
