"""How a behaviour takes its parameters, at load and at run time (helm.md 4.1, 7.1).

Half of `Behavior`, kept apart because authors of behaviours rarely need to look in here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from mypy_extensions import mypyc_attr

from ivp_helm.base_parameters import BASE_PARAMETERS, FLAG_KEYS
from ivp_helm.conditions import ConditionSet, parse_condition, variables_of
from ivp_helm.flags import Flag
from pymoos_lite.config.parameters import Declaration, ParameterError, Values

POLICIES = ("open", "lean", "dire")


@mypyc_attr(allow_interpreted_subclasses=True)
class Configurable:
    """Holds typed parameter values in `config`; a method ``set_<parameter>`` takes over where storing is not enough."""

    BASE_PARAMETERS: ClassVar[Declaration] = BASE_PARAMETERS
    """Parameters shared by all of its kind; see `base_declaration` for the defaults of this class."""
    PARAMETERS: ClassVar[Declaration] = Declaration()
    """The parameters of this class."""
    DEFAULTS: ClassVar[Mapping[str, Any]] = {}
    """Other defaults of base parameters, e.g. ``{"duration": 0.0}``."""
    INFO: ClassVar[tuple[str, ...]] = ()
    """Variables it reads from the buffer, apart from NAV_* and those named by parameters."""

    _declared: ClassVar[Declaration | None] = None

    def __init__(self) -> None:
        self.config: Values = self.declaration().defaults()
        self.given: set[str] = set()
        """Parameters (attribute names) that were set so far."""
        self.conditions = ConditionSet()
        self._mapping: dict[str, str] = {}
        self._watched: dict[str, None] = dict.fromkeys(type(self).INFO)
        self._policy = "open"

    @classmethod
    def declaration(cls) -> Declaration:
        """The parameters of every behaviour and of this class."""
        found: Declaration | None = vars(cls).get("_declared")
        if found is None:
            found = cls._declared = cls.base_declaration() + cls.PARAMETERS
        return found

    @classmethod
    def base_declaration(cls) -> Declaration:
        """`BASE_PARAMETERS` with the defaults of this class and of those it is made from."""
        defaults: dict[str, Any] = {}
        for kind in reversed(cls.__mro__):
            defaults.update(vars(kind).get("DEFAULTS", {}))
        changed = [replace(p, default=defaults[p.key]) for p in cls.BASE_PARAMETERS if p.key in defaults]
        return cls.BASE_PARAMETERS + Declaration(tuple(changed)) if changed else cls.BASE_PARAMETERS

    def set_parameter(self, name: str, text: str) -> None:
        """Give one parameter its value, as a line of a block or of an update does.

        Raises:
            ParameterError: unknown name or unacceptable value; the old value stays.
        """
        declaration = self.declaration()
        key = name.strip().lower()
        parameter = declaration.find(key)
        if parameter is None and key.startswith("_") and BASE_PARAMETERS.find(key[1:]) is not None:
            parameter = declaration.find(key[1:])
        if parameter is None:
            if key in declaration.ignored:
                return
            declaration.read(name, text)  # raises, with the nearest spelling
            return
        attribute = parameter.key
        word = text.strip().lower()
        current = getattr(self.config, attribute)
        if parameter.kind == "boolean" and word == "toggle":
            value: Any = not current
        elif parameter.repeated and word == "clearall":
            current.clear()
            self.given.add(attribute)
            return
        else:
            value = parameter.read(text)
        setter = getattr(self, f"set_{attribute}", None)
        if setter is not None:
            try:
                setter(value)
            except ParameterError:
                raise
            except ValueError as error:
                raise ParameterError(f"{parameter.name} = {text.strip()!r}: {error}") from None
        elif parameter.repeated:
            current.append(value)
        else:
            vars(self.config)[attribute] = value
        self.given.add(attribute)

    def set_condition(self, condition: Any) -> None:
        """Add a condition; there is no way to remove one."""
        self.config.condition.append(condition)
        self.conditions = ConditionSet(self.config.condition)

    def resolve_conditions(self) -> None:
        """Put the contact's name into conditions: ``$[CONTACT]`` in capitals, ``$[contact]`` small, ``$[Contact]``
        as it is (helm.md 4.5)."""
        contact = str(vars(self.config).get("contact", ""))
        spellings = (
            ("$[CONTACT]", contact.upper()),
            ("$[contact]", contact.lower()),
            ("$[Contact]", contact),
        )
        if contact and any("$[" in condition.text for condition in self.config.condition):
            resolved = []
            for condition in self.config.condition:
                text = condition.text
                for spelling, name in spellings:
                    text = text.replace(spelling, name)
                resolved.append(condition if text == condition.text else parse_condition(text))
            self.conditions = ConditionSet(resolved)

    def set_post_mapping(self, pair: tuple[str, str]) -> None:
        """Redirect or silence posts."""
        self.config.post_mapping.append(pair)
        self._mapping = dict(self.config.post_mapping)

    def set_comms_policy(self, policy: str) -> None:
        """How much to post."""
        self._policy = policy
        vars(self.config)["comms_policy"] = policy

    def set_build_info(self, text: str) -> None:
        """Collect hints; what the user gives last wins, ``clear`` forgets all (ivp_math.md 6.2)."""
        former = self.config.build_info
        cleared = text.strip().lower() == "clear"
        vars(self.config)["build_info"] = "clear" if cleared else f"{former} # {text}".removeprefix(" # ")

    def follow_comms_policy(self, policy: str) -> None:
        """Obey the community's policy where it is tighter than the behaviour's own."""
        own = self.config.comms_policy
        if policy in POLICIES:
            self._policy = max(policy, own, key=POLICIES.index)

    @property
    def visuals(self) -> bool:
        """Whether to post shapes for viewers (``comms_policy`` is open)."""
        return self._policy == "open"

    def watch(self, *variables: str) -> None:
        """Ask for mail of more variables than `INFO` names (e.g. those that a parameter names).

        To be called while parameters are given or from `on_parameters`: the helm registers after those.
        """
        self._watched.update(dict.fromkeys(v for v in variables if v))

    def variables_needed(self) -> list[str]:
        """Every variable the helm must register for on this behaviour's behalf."""
        config = self.config
        names = variables_of(self.conditions)
        for flag in self.all_flags():
            if flag.condition is not None:
                names += flag.condition.registrations()
        if config.duration_reset is not None:
            names.append(config.duration_reset[0])
        for starving, _ in config.nostarve:
            names += starving
        names += [config.updates] if config.updates else []
        return list(dict.fromkeys((*names, *self._watched)))

    def all_flags(self) -> list[Flag]:
        """Every flag of this behaviour, those of its own parameters included."""
        found: list[Flag] = []
        for value in vars(self.config).values():
            if isinstance(value, list):
                found += [item for item in value if isinstance(item, Flag)]
        return found

    def state_flags(self) -> list[Flag]:
        """The flags of base parameters."""
        return [flag for key in FLAG_KEYS for flag in getattr(self.config, key)]
