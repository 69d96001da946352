"""For authors of behaviours: a helm on the bench, and a check that a behaviour keeps the contract.

    rig = HelmRig([("BHV_Waypoint", {"points": "0,0:50,0", "speed": "2"})])
    rig.own(x=10, y=5, heading=90, speed=1.5)
    rig.iterate()
    assert rig.decision == {"course": 97.0, "speed": 2.0}
    assert rig.posted("WPT_INDEX") == [0.0]

No socket, no file, no clock: time goes on by `period` with every iteration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ivp_helm import contract
from ivp_helm.behavior import Behavior
from ivp_helm.behavior_file import BehaviorBlock, BehaviorFile, Initialization, read_behavior_file
from ivp_helm.helm import HelmCore, Trace
from ivp_helm.ivp import parse_entry
from ivp_helm.lifecycle import Life, Outcome
from ivp_helm.platform_model import read_turn_model
from ivp_helm.plugins import BehaviorFinder
from ivp_helm.settings import HelmSettings
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message, Value, as_value

DOMAIN = ("course:0:359:360", "speed:0:5:21")
DEPTH = "depth:0:100:101:optional"
START = 1_700_000_000.0
Parameters = Mapping[str, object] | Sequence[tuple[str, object]]


@dataclass(frozen=True, slots=True)
class Posting:
    """Something the helm published: in which iteration, on whose behalf, and what."""

    iteration: int
    behavior: str
    variable: str
    value: Value


class HelmRig:
    """A helm core with a clock of its own, fed by hand.

    `behaviors` are (type name or class, parameters); `text` is a whole `.bhv` file instead. Iteration k
    happens at `start + k * period`. Raises `AssertionError` when the configuration has errors, unless
    `faulty` says that this is expected.
    """

    def __init__(
        self,
        behaviors: Sequence[tuple[str | type[Behavior], Parameters]] = (),
        *,
        text: str = "",
        domain: Sequence[str] = DOMAIN,
        community: str = "alpha",
        period: float = 0.25,
        start: float = START,
        initial: Mapping[str, object] | None = None,
        turn_model: str = "",
        faulty: bool = False,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        self.now = start
        self.period = period
        classes = {_type_name(kind): kind for kind, _ in behaviors if not isinstance(kind, str)}
        finder = BehaviorFinder()
        content = read_behavior_file(text, "test.bhv")
        blocks = [_block(kind, parameters) for kind, parameters in behaviors]
        more = [_initialization(name, value) for name, value in (initial or {}).items()]
        content = BehaviorFile(
            "test.bhv",
            (*content.initializations, *more),
            content.modes,
            (*content.blocks, *blocks),
            content.problems,
        )
        options: dict[str, Any] = {"start_in_drive": True, "settle": 0.0, **(settings or {})}
        self.core = HelmCore(
            HelmSettings(
                entries=tuple(parse_entry(entry) for entry in domain),
                community=community,
                turn_model=read_turn_model(turn_model) if turn_model else None,
                **options,
            ),
            content,
            lambda kind: classes.get(kind) or finder(kind),
        )
        if not faulty:
            assert not self.core.authority.malconfig, "\n".join(str(p) for p in self.core.problems)
        self.postings: list[Posting] = []
        """Everything published on behalf of behaviours, in order."""
        self.published: list[tuple[int, str, Value]] = []
        """Everything published at all: iteration, variable, value."""
        self._own: dict[str, float] = {}
        self._mail: list[Message] = []
        self._contacts: list[Mapping[str, Any]] = []
        self.core.start(start)
        self._collect()

    # --- giving -------------------------------------------------------------------------------------------

    def own(
        self, x: float = 0.0, y: float = 0.0, heading: float = 0.0, speed: float = 0.0, depth: float = 0.0
    ) -> None:
        """Own ship's state, mailed before every iteration from now on."""
        self._own = {"NAV_X": x, "NAV_Y": y, "NAV_HEADING": heading, "NAV_SPEED": speed, "NAV_DEPTH": depth}

    def contacts(self, contacts: Sequence[Mapping[str, Any]]) -> None:
        """Other vessels, reported before every iteration from now on: name, x, y, heading, speed, and
        report_age in seconds."""
        self._contacts = list(contacts)

    def _reports(self) -> list[Message]:
        found = []
        for contact in self._contacts:
            stamp = self.now - float(contact.get("report_age", 0.0))
            text = (
                f"NAME={contact['name']},TYPE={contact.get('type', 'kayak')},TIME={stamp:.3f},"
                f"X={contact['x']},Y={contact['y']},SPD={contact['speed']},HDG={contact['heading']},"
                "DEP=0,LENGTH=4,MODE=DRIVE,ALLSTOP=clear"
            )
            found.append(Message("NODE_REPORT", text, self.now, "reporter"))
        return found

    def mail(self, variable: str, value: object, source: str = "test") -> None:
        """A value for the next iteration."""
        self._mail.append(Message(variable, as_value(value), self.now + self.period, source))

    def iterate(self, times: int = 1) -> Trace | None:
        """Let time go on and the helm iterate; returns the last trace."""
        for _ in range(times):
            self.now += self.period
            nav = [Message(name, float(value), self.now, "nav") for name, value in self._own.items()]
            self.core.deliver([*nav, *self._reports(), *self._mail], self.now)
            self._mail = []
            self.core.iterate(self.now)
            self._collect()
        return self.core.trace

    def _collect(self) -> None:
        self.core.take_registrations()
        for post in self.core.take_posts():
            self.published.append((self.core.iteration, post.variable, post.value))
            iteration, colon, behavior = post.aux.partition(":")
            if colon and iteration.isdigit():
                self.postings.append(Posting(int(iteration), behavior, post.variable, post.value))

    # --- asking -------------------------------------------------------------------------------------------

    @property
    def decision(self) -> dict[str, float]:
        """What the last iteration decided, empty for an all-stop."""
        trace = self.core.trace
        return dict(trace.decision) if trace is not None and trace.reason == "clear" else {}

    @property
    def reason(self) -> str:
        """``clear``, or why the vehicle is stopped."""
        return self.core.allstop.reason

    def posted(self, variable: str) -> list[Value]:
        """All values published in a variable, in order."""
        return [value for _, name, value in self.published if name == variable]

    def outcome(self, name: str) -> Outcome:
        """What the last iteration of a behaviour came to.

        Raises:
            KeyError: it did not take part.
        """
        trace = self.core.trace
        for life, outcome in trace.rounds if trace is not None else ():
            if life.name == name:
                return outcome
        raise KeyError(name)

    def life(self, name: str) -> Life:
        """A living behaviour's passage.

        Raises:
            KeyError: there is none of that name.
        """
        for life in self.core.population:
            if life.name == name:
                return life
        raise KeyError(name)


def check_behavior(
    cls: type[Behavior],
    parameters: Parameters | None = None,
    *,
    domain: Sequence[str] | None = None,
    contacts: Sequence[Mapping[str, Any]] = (),
    clocks: Sequence[str] = (),
) -> None:
    """Check that a behaviour keeps the contract that the helm, its tools and its users rely on.

    It is documented; refuses nonsense; runs without errors in random situations; its functions are finite,
    sound and over the domain; it is silent while idle; does no I/O and reads no clock; changes nothing but by
    posting; and does the same when everything is repeated. `domain` is by default course and speed, and
    depth if it needs that; it must hold the behaviour's variables. `contacts`
    are those (name, x, y, heading, speed) whom its parameters name, `clocks` the variables in which it tells the time
    even while idle.

    Raises:
        ContractError: an AssertionError that lists every broken clause.
    """
    findings = contract.Findings(cls.__name__)
    contract.check_declaration(cls, findings)
    pairs = list(parameters.items()) if isinstance(parameters, Mapping) else list(parameters or ())
    if not any(key == "name" for key, _ in pairs):
        pairs.insert(0, ("name", "subject"))
    pairs.append(("condition", f"{contract.SWITCH} = true"))

    if domain is None:
        domain = (*DOMAIN, DEPTH) if "depth" in cls.VARIABLES else DOMAIN

    def make() -> HelmRig:
        return HelmRig([(cls, pairs)], domain=domain)

    try:
        behavior = next(life.behavior for life in make().core.population)
    except AssertionError as error:
        findings.must(False, f"it can be made with the parameters given ({error})")
        findings.conclude()
        raise
    contract.check_refusals(behavior, findings)
    first = contract.sail(make, contacts, findings)
    with contract.no_io() as offences:
        second = contract.sail(make, contacts, findings)
    findings.must(not offences, f"it does no I/O (it called {', '.join(sorted(set(offences)))})")
    findings.must(first == second or bool(offences), "the same inputs give the same functions and posts")
    contract.check_quiet(make, findings, clocks)
    findings.conclude()


def _type_name(kind: type[Behavior]) -> str:
    return kind.BHV_NAME or kind.__name__


def _block(kind: str | type[Behavior], parameters: Parameters) -> BehaviorBlock:
    pairs = parameters.items() if isinstance(parameters, Mapping) else parameters
    lines = []
    for number, (key, value) in enumerate(pairs, 1):
        for item in value if isinstance(value, list | tuple) else [value]:
            lines.append(ConfigLine(key.lower(), _shown(item), number))
    return BehaviorBlock(kind if isinstance(kind, str) else _type_name(kind), tuple(lines), 1, "test.bhv")


def _initialization(name: str, value: object) -> Initialization:
    typed = as_value(value)
    assert not isinstance(typed, bytes)
    return Initialization(name, typed)


def _shown(value: object) -> str:
    return str(as_value(value)) if isinstance(value, bool) else str(value)
