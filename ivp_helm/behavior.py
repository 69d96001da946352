"""The base class of all behaviours: what an author fills in, and what an author may use.

A behaviour is one opinion about where the vehicle should go next. A complete one:

    from ivp_helm.behavior import Behavior
    from ivp_helm.ivp import IvPFunction, Peak, zaic_peak
    from pymoos_lite.config.parameters import Declaration, Parameter

    class HoldDepth(Behavior):
        '''Keeps a depth.'''

        BHV_NAME = "BHV_HoldDepth"
        VARIABLES = ("depth",)
        PARAMETERS = Declaration((Parameter("depth", "number", 0.0, "m", "Depth to keep.", low=0.0),))

        def on_run(self) -> IvPFunction | None:
            self.why = f"{abs(self.own.depth - self.config.depth):.1f} m from the depth asked for"
            self.post("DEPTH_ERROR", self.own.depth - self.config.depth)
            return zaic_peak(self.domain, "depth", Peak(self.config.depth, basewidth=20))

Life of a behaviour (helm.md 5.2). Hooks marked * must not be slow: they are inside the helm's iteration.

    setup             once, before parameters: make your own attributes
    set_<parameter>   a parameter is given: only if storing its value in `config` is not enough
    check             all lines of the block are read: return what is wrong
    on_helm_start     once at helm start, also for a template that only spawns
    on_parameters     all parameters of a start, a spawning or an update are in place
    on_spawn          made at run time, after on_parameters
    on_every_state *  every iteration, before the others
    on_idle *         conditions do not hold
    on_run_to_idle *  they stopped to hold, before on_idle
    on_idle_to_run *  they began to hold (also in the first iteration), before on_run
    on_run *          conditions hold: return an objective function, or None for no opinion
    on_inactive *     on_run returned None
    on_disabled *     switched off by BHV_ABLE_FILTER
    on_complete *     completed, once; the behaviour is removed after this iteration

Units everywhere: x east and y north in metres, degrees clockwise from north, m/s, seconds, metres down.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, ClassVar

from mypy_extensions import mypyc_attr

from ivp_helm.conditions import holds
from ivp_helm.configurable import Configurable
from ivp_helm.flags import Flag
from ivp_helm.macros import Counters, base_macro
from ivp_helm.surroundings import MissingOwnship, Ownship, Surroundings
from pymoos_lite.core.message import Value, as_value
from pymoos_lite.records.node_message import NodeMessage

if TYPE_CHECKING:
    from ivp_helm.info_buffer import InfoBuffer
    from ivp_helm.ivp import Domain, IvPFunction


class BehaviorError(Exception):
    """Raised by a behaviour that cannot do its work: the helm stops the vehicle and says why."""


class Post:
    """Something a behaviour wants published. Posts of one key that repeat a value are dropped.

    `key` None means never dropped. `retracts` marks the withdrawal of a warning.
    """

    # No tuple: compiled, a class of its own is made and read in half the time, and there are many.
    __slots__ = ("key", "retracts", "value", "variable")

    def __init__(self, variable: str, value: Value, key: str | None = "", retracts: bool = False) -> None:
        self.variable = variable
        self.value = value
        self.key = key
        self.retracts = retracts


@mypyc_attr(allow_interpreted_subclasses=True)
class Behavior(Configurable):
    """Base of all behaviours; see the module for the life cycle."""

    BHV_NAME: ClassVar[str] = ""
    """The name a mission file calls the class by: ``BHV_Waypoint``."""
    DEFAULT_NAME: ClassVar[str] = "???"
    """The instance's name when the block gives none."""
    VARIABLES: ClassVar[tuple[str, ...]] = ("course", "speed")
    """Decision variables without which it cannot run."""
    CONSTRAINT: ClassVar[bool] = False
    """True for avoidance and limits, which are no goal of their own (``goals_mandatory``)."""
    CAN_DISABLE: ClassVar[bool] = False
    """True for classes that obey BHV_ABLE_FILTER (if their ``can_disable`` says so)."""
    DEPRECATED: ClassVar[str] = ""
    """Why nobody should use it any more; a block must say ``i_understand_this_behavior_is_deprecated = true``."""
    RETIRED: ClassVar[Mapping[str, str]] = {}
    """Parameters that are gone, and what to use instead; refused unless the helm accepts retired things."""
    FILTER_LEVEL: ClassVar[int] = 0
    """1 for behaviours that see the decision of all others before they run (helm.md 11.6)."""

    def __init__(self, surroundings: Surroundings, name: str = "") -> None:
        super().__init__()
        self.surroundings = surroundings
        self.buffer: InfoBuffer = surroundings.buffer
        self.domain: Domain = surroundings.domain
        self.max_speed: float = self.domain["speed"].high if "speed" in self.domain else 0.0
        """The highest speed of the domain, 0 without one."""
        self.community = surroundings.community
        self.name = name or type(self).DEFAULT_NAME
        self._why: str | Callable[[], str] = ""
        self.relevance = 1.0
        """How much of `pwt` the function returned next carries; back at 1 before each `on_run`."""
        self.state = ""
        """State after the previous iteration: idle, running, active, disabled, completed; at first empty."""
        self.iteration = 0
        """Helm iterations it has been part of."""
        self.run_time = 0.0
        self.idle_time = 0.0
        self.completed = False
        self.post_mortem = ""
        self.spawned = False
        self.is_template = False
        """Instances are made from its block on request (it may be no more than the block's proof)."""
        self.failed = False
        """An error was posted in this iteration."""
        self.last_error = ""
        self._posts: list[Post] = []
        self._warned: set[str] = set()
        self.counters = Counters()
        self.setup()

    # --- hooks ------------------------------------------------------------------------------------------

    def setup(self) -> None:
        """Make your own attributes; parameters still have their defaults."""

    def check(self) -> Iterable[str]:
        """What is wrong with the parameters taken together; empty when they fit."""
        return ()

    def on_helm_start(self) -> None:
        """The helm starts. Called for templates too, whose posts go out all the same."""

    def on_parameters(self) -> None:
        """All parameters of a start, a spawning or an update are in `config`."""

    def on_spawn(self) -> None:
        """Made at run time from a template."""

    def on_every_state(self) -> None:
        """Called first in every iteration, whatever the state."""

    def on_idle(self) -> None:
        """Conditions do not hold."""

    def on_run_to_idle(self) -> None:
        """Conditions just stopped to hold: drop what should not outlive the run."""

    def on_idle_to_run(self) -> None:
        """Conditions just began to hold."""

    def on_run(self) -> IvPFunction | None:
        """Conditions hold: what do you want? Called in every such iteration.

        Return a function over `domain` or some of its variables, or None. Its weight is set for you:
        `pwt` times `relevance`. Returning the very object of the last iteration says that nothing changed.
        """
        return None

    def on_inactive(self) -> None:
        """`on_run` had no opinion."""

    def on_disabled(self) -> None:
        """Switched off by BHV_ABLE_FILTER."""

    def on_complete(self) -> None:
        """Completed; called once."""

    def settings(self) -> str:
        """Text after ``type=..,name=..,`` of BHV_SETTINGS, posted at start and after updates; empty: none."""
        return ""

    def mode(self) -> tuple[str, str]:
        """Mode and submode shown in the helm's summary; without ``:``, ``$`` and ``,``."""
        return "", ""

    def macro(self, name: str) -> float | str | None:
        """The value of a macro of your own in flags, None if you have none of that name."""
        return None

    def lost_its_contact(self) -> bool:
        """Whether a spawned behaviour's contact is gone from the ledger, so that it has nothing left to do."""
        contact = vars(self.config).get("contact")
        return bool(contact) and contact not in self.surroundings.contacts

    def able_fields(self) -> dict[str, str]:
        """What selectors of BHV_ABLE_FILTER compare with: ``contact``, ``vsource``, ``obstacle``."""
        contact = str(vars(self.config).get("contact", ""))
        known = self.surroundings.contacts.get(contact)
        return {"contact": contact, "vsource": known.report.vsource if known is not None else ""}

    # --- what the helm lends --------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Mission time of this iteration, in seconds."""
        return self.buffer.now

    @property
    def own(self) -> Ownship:
        """Own ship: x, y, heading, speed, depth.

        Raises:
            MissingOwnship: position or heading is unknown; let it pass, the helm then stops the vehicle.
        """
        own = self.surroundings.own
        if own is None:
            raise MissingOwnship(self.surroundings.missing_own())
        return own

    @property
    def why(self) -> str:
        """One line on why it is where it is, e.g. ``leg 3 of 7, 42 m to go``; shown by `explain`."""
        said = self._why
        return said if isinstance(said, str) else said()

    @why.setter
    def why(self, text: str) -> None:
        self._why = text

    def explain(self, words: Callable[[], str]) -> None:
        """Set `why` to what `words` returns, which is asked only when somebody wants to know.

        It is asked later, so it should read nothing that changes: bind numbers, not their owners.
        """
        self._why = words

    @property
    def pwt(self) -> float:
        """The priority weight."""
        return float(self.config.pwt)

    def number(self, variable: str) -> float | None:
        """A number from the buffer; a missing one is a warning and None."""
        value = self.buffer.number(variable)
        if value is None:
            self.warn(f"{variable} dbl info not found in helm info_buffer")
        return value

    def text(self, variable: str) -> str | None:
        """A text from the buffer; a missing one is a warning and None."""
        value = self.buffer.text(variable)
        if value is None:
            self.warn(f"{variable} str info not found in helm info_buffer")
        return value

    # --- what a behaviour says ----------------------------------------------------------------------------

    def post(self, variable: str, value: object, key: str = "", repeat: bool = False) -> None:
        """Publish `value` (number, text, boolean) in `variable` after this iteration.

        A value equal to the last one of the same variable and `key` is not sent again, unless `repeat`.
        """
        if not variable:
            return
        if self._mapping:
            variable = self._mapping.get(variable, variable)
            if variable.lower() == "silent":
                return
        kind = type(value)
        typed: Value = value if kind is float or kind is str else as_value(value)  # type: ignore[assignment]
        self._posts.append(Post(variable, typed, None if repeat else key))

    def post_int(self, variable: str, value: float, key: str = "") -> None:
        """Publish the nearest whole number (halves go up); nothing for infinite and undefined values."""
        if abs(value) < 2.0**53:
            self.post(variable, float(int(value + 0.5) if value >= 0 else -int(0.5 - value)), key)

    def post_flags(self, flags: Iterable[Flag], tag: str = "", repeat: bool = True) -> None:
        """Publish flags: macros expanded, conditions and destinations honoured.

        With `tag` only those that carry it. `repeat` off drops a value equal to the last one sent.
        """
        for flag in flags:
            if (tag and flag.tag != tag) or (
                flag.condition is not None and not holds(flag.condition, self.buffer)
            ):
                continue
            self.counters.count(flag)
            value = flag.expand(self._macro_value)
            if not flag.destination or flag.destination.endswith("+"):
                self.post(flag.variable, value, repeat=repeat)
            if flag.destination:
                self._post_offboard(flag.destination.rstrip("+"), flag.variable, value)

    def _post_offboard(self, destination: str, variable: str, value: Value) -> None:
        group = ""
        if destination == "group":
            group = self.buffer.text(f"{self.community.upper()}_NAV_GROUP") or ""
        if isinstance(value, bytes):
            return
        message = NodeMessage(
            src_node=self.community,
            dest_node="all",
            dest_group=group,
            src_app="pHelmIvP",
            src_bhv=self.name,
            var_name=variable,
            value=value,
        )
        self.post("NODE_MESSAGE_LOCAL", message.to_text(mark_quoted=True), repeat=True)

    def error(self, text: str) -> None:
        """Something is wrong: BHV_ERROR; the helm stops the vehicle in this iteration."""
        self.failed = True
        self.last_error = f"{self.name}: {text}"
        self._posts.append(Post("BHV_ERROR", self.last_error, None))

    def warn(self, text: str) -> None:
        """Something is not as it should be: BHV_WARNING, shown until `retract_warning` of the same text."""
        if text:
            self._warned.add(text)
            self._posts.append(Post("BHV_WARNING", f"{self.name}: {text}", None))

    def retract_warning(self, text: str) -> None:
        """The matter of an earlier `warn` is settled; without one this does nothing."""
        if text in self._warned:
            self._warned.discard(text)
            self._posts.append(Post("BHV_WARNING", f"{self.name}: {text}", "retract", True))

    def bad_config(self, text: str) -> None:
        """A parameter makes no sense now that its surroundings are known: BHV_BAD_CONFIG."""
        self._posts.append(Post("BHV_BAD_CONFIG", f"{self.name}: {text}", None))

    def event(self, text: str, repeat: bool = False) -> None:
        """Something worth telling happened: BHV_EVENT."""
        self._posts.append(Post("BHV_EVENT", f"{self.name}: {text}", None if repeat else ""))

    def complete(self, reason: str = "") -> None:
        """Done: end flags are posted; unless ``perpetual``, the behaviour ends with this iteration.

        `reason` goes to the life event's post_mortem.
        """
        self.post_flags(self.config.endflag)
        if not self.config.perpetual:
            self.completed = True
            self.post_mortem = reason

    def take_posts(self) -> list[Post]:
        """Everything posted since the last call (for the helm and for tests)."""
        posts = self._posts
        self._posts = []
        return posts

    def _macro_value(self, name: str) -> float | str | None:
        value = self.macro(name)
        return base_macro(self, name) if value is None else value

    def __repr__(self) -> str:
        return f"<{type(self).BHV_NAME or type(self).__name__} {self.name!r} {self.state or 'new'}>"
