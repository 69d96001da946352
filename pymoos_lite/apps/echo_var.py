"""pEchoVar: posts variables again under other names, and takes apart and renames `k=v` reports (community.md 18).

`EchoPlan` is the pure part: which variables lead where, and whether that runs in a circle.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.conditions import parse_condition
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message, Value
from pymoos_lite.records.csp import clip, split_protected, unquote

_INVERTED = {"true": "false", "false": "true"}
_FLIP_KEYS = ("source_variable", "dest_variable", "source_separator", "dest_separator", "filter", "component")


@dataclass(frozen=True, slots=True)
class Echo:
    """`source -> target`; `inverted` swaps the texts true and false."""

    source: str
    target: str
    inverted: bool = False

    def value_of(self, value: Value) -> Value:
        if not self.inverted or not isinstance(value, str):
            return value
        swapped = _INVERTED.get(value.strip().lower(), value)
        return swapped.upper() if value.isupper() else swapped


@dataclass(slots=True)
class Flip:
    """One `FLIP:id` group: which fields of a report go on, under which names, to which variable."""

    name: str
    source: str = ""
    target: str = ""
    source_separator: str = ","
    target_separator: str = ","
    components: dict[str, str] = field(default_factory=dict)
    filters: list[tuple[str, str]] = field(default_factory=list)

    def configure(self, text: str) -> None:
        """Take one configuration value of the group. Raises ValueError with what would be right."""
        key, equals, value = (part.strip() for part in text.partition("="))
        key = key.lower()
        rule = value if equals and key in ("filter", "component") else text.strip()
        if "->" in rule:
            old, _, new = (part.strip() for part in rule.partition("->"))
            if not old or not new:
                raise ValueError(f"'{clip(text)}': expected component = OLD -> NEW")
            self.components[old] = new
        elif "==" in rule:
            field_name, _, wanted = (part.strip() for part in rule.partition("=="))
            if not field_name:
                raise ValueError(f"'{clip(text)}': expected filter = FIELD == VALUE")
            self.filters.append((field_name, wanted))
        elif not value or key not in _FLIP_KEYS[:4]:
            raise ValueError(f"'{clip(text)}': expected one of {', '.join(_FLIP_KEYS)} = ...")
        elif key == "source_variable":
            self.source = value
        elif key == "dest_variable":
            self.target = value
        elif key == "source_separator":
            self.source_separator = unquote(value)
        else:
            self.target_separator = unquote(value)

    def apply(self, text: str) -> str | None:
        """The new report; None if a filter says no or none of the fields is there."""
        found = [
            (key.strip(), value.strip())
            for key, equals, value in (p.partition("=") for p in split_protected(text, self.source_separator))
            if equals
        ]
        present = dict(found)
        for key, wanted in self.filters:
            if key in present and present[key].lower() != wanted.lower():
                return None
        kept = [f"{self.components[key]}={value}" for key, value in found if key in self.components]
        return self.target_separator.join(kept) or None


def parse_echo(text: str) -> list[Echo]:
    """`A -> B`, `A !-> B`, `A -> B, C`, chains `A -> B -> C`. Raises ValueError."""
    parts = text.split("->")
    echoes: list[Echo] = []
    sources: list[str] = []
    inverted = False
    for index, part in enumerate(parts):
        inverts_next = part.rstrip().endswith("!")
        part = part.rstrip().removesuffix("!")
        names = [name.strip() for name in part.split(",")]
        if any(not name or len(name.split()) != 1 for name in names) or (index == 0 and len(names) > 1):
            raise ValueError(f"'{clip(text)}': expected SOURCE -> TARGET or SOURCE !-> TARGET")
        echoes += [Echo(source, name, inverted) for source in sources for name in names]
        sources, inverted = names, inverts_next
    if not echoes or inverted:
        raise ValueError(f"'{clip(text)}': expected SOURCE -> TARGET or SOURCE !-> TARGET")
    return echoes


def find_cycle(edges: Iterable[tuple[str, str]]) -> list[str]:
    """Names along a circle of echoes, first one repeated at the end; empty if there is none."""
    targets: dict[str, list[str]] = {}
    for source, target in edges:
        targets.setdefault(source, []).append(target)
    finished: set[str] = set()
    for first in targets:
        path: list[str] = []
        pending = [(first, iter(targets[first]))]
        while pending:
            name, rest = pending[-1]
            if name not in path:
                path.append(name)
            following = next(rest, None)
            if following is None:
                pending.pop()
                path.pop()
                finished.add(name)
            elif following in path:
                return [*path[path.index(following) :], following]
            elif following not in finished:
                pending.append((following, iter(targets.get(following, ()))))
    return []


class EchoVar(App):
    """The echo app; see the module."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "echo",
                "custom",
                None,
                "",
                "SOURCE -> TARGET; !-> swaps true and false.",
                repeated=True,
                parse=parse_echo,
                example="FOO -> BAR",
            ),
            Parameter(
                "condition",
                "custom",
                None,
                "",
                "Echo only while all conditions hold.",
                repeated=True,
                parse=parse_condition,
                example="DEPLOY = true",
            ),
            Parameter(
                "hold_messages",
                "boolean",
                True,
                "",
                "Keep the latest of each source until the conditions hold.",
            ),
            Parameter(
                "echo_latest_only", "boolean", False, "", "Only the latest of each source per iteration."
            ),
        ),
        open_keys=lambda key: key.strip().lower().startswith("flip"),
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.echoes: list[Echo] = list(dict.fromkeys(echo for group in self.config.echo for echo in group))
        self.flips = self._read_flips()
        self.cycle: list[str] = []
        self.known: dict[str, Value] = {}
        self.waiting: list[Message] = []
        self.counts: dict[str, int] = {}

    def _read_flips(self) -> list[Flip]:
        flips: dict[str, Flip] = {}
        for line in self.extra_lines:
            name = line.key.partition(":")[2].strip().lower()
            flip = flips.setdefault(name, Flip(name))
            try:
                flip.configure(line.value)
            except ValueError as refusal:
                self.config_warning(f"{self.context.mission_file}:{line.line}: {line.key} = {refusal}")
        complete = []
        for flip in flips.values():
            if flip.source and flip.target and flip.components:
                complete.append(flip)
            else:
                self.config_warning(f"FLIP:{flip.name} needs source_variable, dest_variable and a component")
        return complete

    def on_start_up(self) -> None:
        edges = [(e.source, e.target) for e in self.echoes] + [(f.source, f.target) for f in self.flips]
        self.cycle = find_cycle(edges)
        if self.cycle:
            text = f"echoes run in a circle, nothing is echoed: {' -> '.join(self.cycle)}"
            self.config_warning(text)
            self.run_warning(text)

    def on_connect(self) -> None:
        if self.cycle:
            return
        names = [e.source for e in self.echoes] + [f.source for f in self.flips]
        names += [name for condition in self.config.condition for name in condition.registrations()]
        for name in dict.fromkeys(names):
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        sources = {e.source for e in self.echoes} | {f.source for f in self.flips}
        for message in mail:
            self.known[message.name] = message.value
            if message.name in sources:
                self.waiting.append(message)

    def iterate(self) -> None:
        if not self.waiting:
            return
        if not all(condition.holds(self.known.get) for condition in self.config.condition):
            self.waiting = latest_of_each(self.waiting) if self.config.hold_messages else []
            return
        waiting, self.waiting = self.waiting, []
        for message in latest_of_each(waiting) if self.config.echo_latest_only else waiting:
            self._echo(message)

    def _echo(self, message: Message) -> None:
        for echo in self.echoes:
            if echo.source == message.name:
                self._post(echo.target, echo.value_of(message.value))
        for flip in self.flips:
            if flip.source == message.name and isinstance(message.value, str):
                report = flip.apply(message.value)
                if report is not None:
                    self._post(flip.target, report)

    def _post(self, name: str, value: Value) -> None:
        self.notify(name, value)
        self.counts[name] = self.counts.get(name, 0) + 1

    def report(self) -> Iterable[str]:
        yield f"conditions: {'met' if self._met() else 'not met'}, {len(self.waiting)} messages held"
        for echo in self.echoes:
            arrow = "!->" if echo.inverted else "->"
            yield f"{echo.source} {arrow} {echo.target}: {self.counts.get(echo.target, 0)} posts"
        for flip in self.flips:
            yield f"FLIP:{flip.name} {flip.source} -> {flip.target}: {self.counts.get(flip.target, 0)} posts"

    def _met(self) -> bool:
        return all(condition.holds(self.known.get) for condition in self.config.condition)


def latest_of_each(messages: Sequence[Message]) -> list[Message]:
    """The last message of each variable, in order of arrival."""
    latest: Mapping[str, Message] = {message.name: message for message in messages}
    return [message for message in messages if latest[message.name] is message]
