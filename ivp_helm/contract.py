"""What every behaviour owes its helm, checked by running it (used by `ivp_helm.testing.check_behavior`).

A behaviour is made, sailed through random but repeatable situations, parked and woken, and watched: its
functions must be sound, its posts quiet while nothing happens, its hooks free of I/O, and all of it the same
when done again.
"""

from __future__ import annotations

import builtins
import random
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite
from typing import Any
from unittest import mock

from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Parameter, ParameterError

SWITCH = "CHECK_RUN"
RunRig = Callable[..., Any]


class ContractError(AssertionError):
    """A behaviour broke the contract; the text lists every clause it broke."""


@dataclass
class Findings:
    """Broken clauses, each once."""

    subject: str
    broken: dict[str, None] = field(default_factory=dict)

    def must(self, holds: object, clause: str) -> None:
        if not holds:
            self.broken[clause] = None

    def conclude(self) -> None:
        if self.broken:
            raise ContractError(f"{self.subject} breaks its contract:\n  - " + "\n  - ".join(self.broken))


def check_declaration(cls: type[Behavior], findings: Findings) -> None:
    """The class names and documents itself and its parameters, and its defaults are legal."""
    must = findings.must
    must(cls.BHV_NAME.startswith("BHV_") and cls.BHV_NAME.isidentifier(), "BHV_NAME begins with 'BHV_'")
    must((cls.__doc__ or "").strip() and cls.__doc__ != Behavior.__doc__, "the class has a docstring")
    for parameter in cls.declaration():
        must(parameter.doc.strip(), f"parameter '{parameter.name}' has a line of doc")
        if parameter.kind in ("number", "integer") and parameter.default is not None:
            must(_is_legal(parameter), f"the default of '{parameter.name}' is finite and a legal value")


def _is_legal(parameter: Parameter) -> bool:
    value = float(parameter.default)
    if not isfinite(value):
        return False
    if value < 0.0 and parameter.low is not None and parameter.low >= 0.0:
        return False
    return parameter.high is None or value <= parameter.high


def check_refusals(behavior: Behavior, findings: Findings) -> None:
    """Nonsense is refused with one line, and changes nothing."""
    for parameter in type(behavior).declaration():
        if parameter.kind not in ("number", "integer", "boolean", "choice"):
            continue
        before = repr(vars(behavior.config).get(parameter.key))
        try:
            behavior.set_parameter(parameter.name, "no such value")
            findings.must(False, f"parameter '{parameter.name}' refuses nonsense")
        except ParameterError as error:
            findings.must("\n" not in str(error), f"the refusal of '{parameter.name}' is one line")
        after = repr(vars(behavior.config).get(parameter.key))
        findings.must(before == after, f"a refused value of '{parameter.name}' changes nothing")


def situations(seed: int, count: int) -> list[dict[str, float]]:
    """Own ship's states: a slow random walk with jumps, repeatable."""
    chance = random.Random(seed)
    x, y, heading = 0.0, 0.0, 90.0
    found = []
    for k in range(count):
        jump = 60.0 if k % 7 == 6 else 2.0
        x += chance.uniform(-jump, jump)
        y += chance.uniform(-jump, jump)
        heading = (heading + chance.uniform(-40.0, 40.0)) % 360.0
        found.append(
            {
                "x": x,
                "y": y,
                "heading": heading,
                "speed": chance.choice((0.0, 0.5, 2.0)),
                "depth": chance.uniform(0, 9),
            }
        )
    return found


def check_function(function: IvPFunction, domain_names: Sequence[str], findings: Findings) -> None:
    """Over variables of the domain, finite everywhere, no point left out, a sensible weight."""
    must = findings.must
    must(set(function.domain.names) <= set(domain_names), "functions are over variables of the helm's domain")
    must(isfinite(function.minimum) and isfinite(function.maximum), "utilities are finite")
    must(function.minimum >= -1e4 and function.maximum <= 1e4, "utilities are of the order of 0 to 100")
    must(function.coverage()[0] == 0, "functions cover every point of their domain")
    must(isfinite(function.weight) and function.weight > 0.0, "weights are finite")


@contextmanager
def no_io() -> Iterator[list[str]]:
    """Files, sockets, processes, clocks, the terminal and shared random numbers are out of bounds."""
    offences: list[str] = []

    def forbid(name: str) -> Callable[..., Any]:
        def trap(*arguments: object, **more: object) -> Any:
            offences.append(name)
            raise PermissionError(f"a behaviour may not call {name}")

        return trap

    targets: tuple[tuple[Any, str], ...] = (
        (builtins, "open"),
        (builtins, "print"),
        (builtins, "input"),
        (socket, "socket"),
        (subprocess, "Popen"),
        (time, "time"),
        (time, "sleep"),
        (random, "random"),
        (random, "uniform"),
        (random, "randint"),
        (random, "choice"),
    )
    patches = [
        mock.patch.object(module, name, forbid(f"{module.__name__}.{name}")) for module, name in targets
    ]
    for patch in patches:
        patch.start()
    try:
        yield offences
    finally:
        for patch in reversed(patches):
            patch.stop()


def sail(make: RunRig, contacts: Sequence[Mapping[str, Any]], findings: Findings, seed: int = 7) -> list[Any]:
    """Run, idle and run again through `situations`; returns everything that happened, comparable."""
    rig = make()
    log: list[Any] = []
    name = next((life.name for life in rig.core.population), "")
    for k, own in enumerate(situations(seed, 30)):
        rig.own(**own)
        if contacts:
            rig.contacts(contacts)
        if k in (0, 12, 20):
            rig.mail(SWITCH, "false" if k == 12 else "true")
        before = dict(rig.core.buffer.values)
        trace = rig.iterate()
        if trace is None or not trace.rounds:
            break
        outcome = trace.rounds[0][1]
        findings.must(not outcome.failed, f"it runs without errors (iteration {k + 1}: {_error(rig)})")
        if outcome.function is not None:
            check_function(outcome.function, rig.core.domain.names, findings)
            log.append(outcome.function.table().tolist() if outcome.function.domain.size < 100_000 else None)
        posted = {p.variable for p in rig.postings if p.iteration == trace.iteration}
        changed = {v for v, value in rig.core.buffer.values.items() if before.get(v) != value}
        strange = changed - posted - _MAILED - {v for v in changed if v.endswith(("_NAV_GROUP", "_NAV_TYPE"))}
        findings.must(
            not strange, f"it changes the information buffer only by posting ({', '.join(strange)})"
        )
        log.append((outcome.state, trace.decision, trace.reason))
    log.append([(p.iteration, p.variable, p.value) for p in rig.postings])
    findings.must(all(p.behavior == name for p in rig.postings), "it posts under its own name")
    return log


_MAILED = {"NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "NAV_DEPTH", "NODE_REPORT", SWITCH}


def _error(rig: Any) -> str:
    texts = rig.posted("BHV_ERROR")
    return str(texts[-1]) if texts else "no text"


def check_quiet(make: RunRig, findings: Findings, clocks: Sequence[str] = ()) -> None:
    """Idle, with nothing changing, it says nothing, but for the `clocks` it is there to keep."""
    rig = make()
    rig.own(x=5.0, y=5.0, heading=45.0, speed=1.0)
    rig.mail(SWITCH, "false")
    rig.iterate(3)
    told = len(rig.postings)
    rig.iterate(5)
    extra = sorted({p.variable for p in rig.postings[told:]} - set(clocks))
    findings.must(not extra, f"idle, with nothing changing, it posts nothing (posted {', '.join(extra)})")
