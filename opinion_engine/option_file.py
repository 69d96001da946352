"""Option files: what a fleet can choose, and how the options couple (gcid.md 5).

Text in, frozen `Option`s out; a file with any fault is refused as a whole with one `file:line` sentence.
Opens no file except in `read_options`, and knows nothing of the dynamics beyond the names of the couplings.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from opinion_engine.model import Couplings, OpinionError, input_value
from pymoos_lite.config.parameters import parse_boolean, parse_number
from pymoos_lite.config.problems import ConfigurationError, Problem, did_you_mean

SOCIAL_MODES = ("custom", "cooperative", "competitive", "oblivious")
FUNCTION_TYPES = ("none", "quadratic")
MAX_OPTIONS = 64
PERTURBATION = 0.25 / 3.0  # standard deviation of `randomly_perturb_params`, as a share of the value

_TRUE_WORDS = ("true", "false")


class OptionFileError(ConfigurationError, OpinionError):
    """An option file that cannot be used; prints as `file:line: sentence`."""


def _refuse(file: str, line: int, text: str) -> OptionFileError:
    return OptionFileError(Problem(file, line, text))


@dataclass(frozen=True)
class Condition:
    """`variable` must hold exactly the string `value`; the words true and false compare in any case."""

    variable: str
    value: str

    def holds(self, current: str | None) -> bool:
        """Whether it is satisfied by the last string value of the variable (None: none received)."""
        if current is None:
            return False
        if self.value.lower() in _TRUE_WORDS:
            return current.lower() == self.value.lower()
        return current == self.value


@dataclass(frozen=True)
class Option:
    """One block of an option file. `name` is lower case; `line` is where the block starts."""

    name: str
    outputs: tuple[tuple[str, str], ...]
    input_variable: str
    function_type: str
    social_mode: str
    resistance: float = 10.0
    alpha: float = 1.0
    beta: tuple[tuple[str, float], ...] = ()
    gamma: float = 0.0
    delta: tuple[tuple[str, float], ...] = ()
    input_min: float = 0.0
    input_max: float = 100.0
    input_gain: float = 1.0
    conditions: tuple[Condition, ...] = ()
    perturb: bool = False
    file: str = ""
    line: int = 0

    def utility(self, raw: float) -> float:
        """The input b of a raw value (gcid.md 5)."""
        return input_value(raw, self.input_min, self.input_max, self.input_gain, self.function_type)


@dataclass(frozen=True)
class OptionSet:
    """The options of a fleet, in the order of the blocks: index, tie-break and message order."""

    options: tuple[Option, ...]
    warnings: tuple[Problem, ...] = field(default=(), compare=False)

    @property
    def names(self) -> tuple[str, ...]:
        """The option names, lower case, in order."""
        return tuple(option.name for option in self.options)

    def __len__(self) -> int:
        return len(self.options)

    def couplings(self) -> Couplings:
        """The couplings of the paper's model, every value as configured."""
        index = {name: j for j, name in enumerate(self.names)}
        own, heard = np.zeros((len(self), len(self))), np.zeros((len(self), len(self)))
        for j, option in enumerate(self.options):
            own[j, j], heard[j, j] = option.alpha, option.gamma
            for other, value in option.beta:
                own[j, index[other]] = value
            for other, value in option.delta:
                heard[j, index[other]] = value
        return Couplings(np.array([option.resistance for option in self.options]), own, heard)

    def reference_couplings(self, alpha_as_configured: bool = False) -> Couplings:
        """The couplings as the authors' implementation uses them (gcid.md 2).

        alpha is 1 for every option unless `alpha_as_configured`; a delta without a beta for the same other
        option is dropped.
        """
        couplings = self.couplings()
        own, heard = couplings.own.copy(), couplings.heard.copy()
        if not alpha_as_configured:
            np.fill_diagonal(own, 1.0)
        for j, option in enumerate(self.options):
            paired = {other for other, _ in option.beta}
            for k, name in enumerate(self.names):
                if k != j and name not in paired:
                    heard[j, k] = 0.0
        return Couplings(couplings.resistance, own, heard)

    def perturbed(self, seed: str) -> OptionSet:
        """With the couplings of the options that ask for it multiplied by (1 + 0.25/3 N(0,1)), drawn from
        `seed`.
        """
        draw = random.Random(f"opinion perturbation:{seed}")

        def shaken(value: float) -> float:
            return value * (1.0 + PERTURBATION * draw.gauss(0.0, 1.0))

        changed = []
        for option in self.options:
            if option.perturb:
                option = replace(
                    option,
                    alpha=abs(shaken(option.alpha)),
                    gamma=shaken(option.gamma),
                    beta=tuple((other, shaken(value)) for other, value in option.beta),
                    delta=tuple((other, shaken(value)) for other, value in option.delta),
                )
            changed.append(option)
        return OptionSet(tuple(changed), self.warnings)


def read_options(paths: Iterable[str | Path]) -> OptionSet:
    """The options of one or more files; those of later files are appended.

    Raises OptionFileError if a file cannot be opened or is at fault.
    """
    texts = []
    for path in paths:
        try:
            texts.append((Path(path).read_text(encoding="utf-8-sig", errors="replace"), str(path)))
        except OSError as error:
            reason = error.strerror or type(error).__name__
            raise _refuse(str(path), 0, f"cannot open the option file: {reason}") from None
    return parse_options(texts)


def parse_options(texts: Sequence[tuple[str, str]]) -> OptionSet:
    """The options of (text, file name) pairs. Raises OptionFileError at the first fault."""
    options: list[Option] = []
    warnings: list[Problem] = []
    for text, file in texts:
        found = _parse_blocks(text, file, warnings)
        if not found:
            raise _refuse(file, 0, "there is no social_option block")
        options += found
    if not options:
        raise _refuse("option file", 0, "no option file was given")
    if len(options) > MAX_OPTIONS:
        raise _refuse(
            options[MAX_OPTIONS].file, options[MAX_OPTIONS].line, f"more than {MAX_OPTIONS} options"
        )
    _check_together(options, warnings)
    return OptionSet(tuple(options), tuple(warnings))


def _parse_blocks(text: str, file: str, warnings: list[Problem]) -> list[Option]:
    options: list[Option] = []
    block: _Block | None = None
    announced = 0  # line of a `social_option` whose `{` has not come yet
    for number, row in enumerate(text.splitlines(), start=1):
        row = row.partition("/")[0].strip()
        if not row:
            continue
        if row.lower() == "social_option":
            if announced or block is not None:
                begun = announced or (block.line if block else 0)
                raise _refuse(
                    file, number, f"the block of line {begun} is not closed before the next social_option"
                )
            announced = number
        elif row == "{":
            if not announced:
                raise _refuse(file, number, "'{' without a line 'social_option' before it")
            block, announced = _Block(file, announced), 0
        elif row == "}":
            if block is None:
                raise _refuse(file, number, "'}' without an open social_option block")
            options.append(block.finish(warnings))
            block = None
        elif announced:
            raise _refuse(file, number, f"expected '{{' after social_option, found {_short(row)}")
        elif block is None:
            hint = did_you_mean(row, ("social_option",))
            raise _refuse(file, number, f"text outside a social_option block: {_short(row)}{hint}")
        else:
            block.take(number, row, warnings)
    if block is not None or announced:
        raise _refuse(
            file,
            announced or (block.line if block else 0),
            "the social_option block is never closed with '}'",
        )
    return options


_NUMBERS = {
    "resistance_weight": "resistance",
    "intra_agent_same_option_coupling": "alpha",
    "inter_agent_same_option_coupling": "gamma",
    "input_min": "input_min",
    "input_max": "input_max",
    "input_gain": "input_gain",
}
_COUPLING_LISTS = {
    "intra_agent_inter_option_coupling": "beta",
    "inter_agent_inter_option_coupling": "delta",
}
_REQUIRED = ("name", "option_output", "social_mode", "input", "input_function_type")
_KNOWN = (
    *_NUMBERS,
    *_COUPLING_LISTS,
    *_REQUIRED,
    "active_condition",
    "randomly_perturb_params",
)


class _Block:
    """The lines of one `social_option` block, checked as they come."""

    def __init__(self, file: str, line: int) -> None:
        self.file = file
        self.line = line
        self.seen: dict[str, int] = {}
        self.values: dict[str, object] = {}
        self.pairs: dict[str, dict[str, float]] = {"beta": {}, "delta": {}}
        self.outputs: list[tuple[str, str]] = []
        self.conditions: list[Condition] = []

    def take(self, number: int, row: str, warnings: list[Problem]) -> None:
        key, equals, value = (part.strip() for part in row.partition("="))
        name = key.lower()
        if not equals:
            raise _refuse(self.file, number, f"expected 'parameter = value', found {_short(row)}")
        if name not in _KNOWN:
            raise _refuse(
                self.file, number, f"an option has no parameter {_short(key)}{did_you_mean(name, _KNOWN)}"
            )
        if not value:
            raise _refuse(self.file, number, f"{name} has no value")
        repeatable = name in _COUPLING_LISTS or name in ("option_output", "active_condition")
        if name in self.seen and not repeatable:
            text = f"{name} was already given at line {self.seen[name]}; the last one wins"
            warnings.append(Problem(self.file, number, text, "warning"))
        self.seen[name] = number
        try:
            self._store(name, value, number, warnings)
        except OptionFileError:
            raise
        except ValueError as error:
            raise _refuse(self.file, number, f"{name} = {_short(value)}: {error}") from None

    def _store(self, name: str, value: str, number: int, warnings: list[Problem]) -> None:
        if name in _NUMBERS:
            self.values[_NUMBERS[name]] = self._number(name, value, number)
        elif name in _COUPLING_LISTS:
            other, equals, amount = (part.strip() for part in value.partition("="))
            if not equals or not other:
                raise _refuse(
                    self.file, number, f"{name} = {_short(value)}: expected 'other_option = number'"
                )
            pairs = self.pairs[_COUPLING_LISTS[name]]
            if other.lower() in pairs:
                text = f"{name} for '{other.lower()}' is given twice; the last one wins"
                warnings.append(Problem(self.file, number, text, "warning"))
            pairs[other.lower()] = self._number(name, amount, number)
            self.seen[f"{name} {other.lower()}"] = number
        elif name == "name":
            if any(c in value for c in ":=,") or len(value.split()) != 1:
                raise ValueError("an option name is one word without ':', '=' and ','")
            self.values["name"] = value.lower()
        elif name == "option_output":
            variable, equals, text = (part.strip() for part in value.partition("="))
            if not equals or not variable or not text:
                raise ValueError("expected 'VARIABLE=value'")
            self.outputs.append((variable.upper(), text))
        elif name == "active_condition":
            variable, equals, text = (part.strip() for part in value.partition("="))
            if variable.lower() == "always":
                return
            if not equals or not variable or not text:
                raise ValueError("expected 'VARIABLE=value' or 'always'")
            self.conditions.append(Condition(variable.upper(), text))
        elif name == "social_mode":
            if value not in SOCIAL_MODES:
                raise ValueError(
                    f"expected one of {', '.join(SOCIAL_MODES)}{did_you_mean(value, SOCIAL_MODES)}"
                )
            self.values["social_mode"] = value
        elif name == "input":
            if len(value.split()) != 1:
                raise ValueError("expected a variable name without blanks")
            self.values["input_variable"] = value.upper()
        elif name == "input_function_type":
            word = value.partition(":")[0].strip().lower()
            if word == "linear":
                raise ValueError("linear is announced but nowhere defined; use none for gain * s")
            if word not in FUNCTION_TYPES:
                raise ValueError(f"expected none or quadratic{did_you_mean(word, FUNCTION_TYPES)}")
            self.values["function_type"] = word
        else:
            self.values["perturb"] = parse_boolean(value)

    def _number(self, name: str, text: str, line: int) -> float:
        try:
            value = parse_number(text)
        except ValueError as error:
            raise _refuse(self.file, line, f"{name} = {_short(text)}: {error}") from None
        if name == "resistance_weight" and value <= 0.0:
            raise _refuse(self.file, line, f"resistance_weight = {text}: a resistance is more than 0")
        if name == "intra_agent_same_option_coupling" and value < 0.0:
            raise _refuse(self.file, line, f"{name} = {text}: the self-reinforcement alpha is 0 or more")
        if name == "input_gain" and value <= 0.0:
            raise _refuse(self.file, line, f"input_gain = {text}: a gain is more than 0")
        return value

    def finish(self, warnings: list[Problem]) -> Option:
        for name in _REQUIRED:
            if name not in self.seen:
                title = self.values.get("name")
                of = f"option '{title}'" if title else "this option"
                raise _refuse(self.file, self.line, f"{of} has no {name}, which is required")
        option = Option(
            **self.values,  # type: ignore[arg-type]
            outputs=tuple(self.outputs),
            beta=tuple(self.pairs["beta"].items()),
            delta=tuple(self.pairs["delta"].items()),
            conditions=tuple(self.conditions),
            file=self.file,
            line=self.line,
        )
        if option.input_max <= option.input_min:
            line = max(self.seen.get("input_min", 0), self.seen.get("input_max", 0))
            text = f"input_max = {option.input_max:g} is not above input_min = {option.input_min:g}"
            raise _refuse(self.file, line or self.line, text)
        for list_name, attribute in _COUPLING_LISTS.items():
            if option.name in self.pairs[attribute]:
                text = f"{list_name} couples '{option.name}' with itself; use the same-option coupling"
                raise _refuse(self.file, self.seen[f"{list_name} {option.name}"], text)
        _check_social_mode(option, warnings)
        return option


def _check_social_mode(option: Option, warnings: list[Problem]) -> None:
    """`social_mode` as an assertion about the couplings: a violation is a warning (gcid.md 5)."""
    deltas = [value for _, value in option.delta] or [0.0]
    broken = {
        "custom": "",
        "cooperative": "needs gamma above every delta" if option.gamma <= max(deltas) else "",
        "competitive": "needs gamma below every delta" if option.gamma >= min(deltas) else "",
        "oblivious": "needs gamma and every delta to be 0" if option.gamma or any(deltas) else "",
    }[option.social_mode]
    if broken:
        text = f"option '{option.name}' is declared {option.social_mode}, which {broken}"
        warnings.append(Problem(option.file, option.line, text, "warning"))


def _check_together(options: Sequence[Option], warnings: list[Problem]) -> None:
    first: dict[str, Option] = {}
    for option in options:
        if option.name in first:
            where = f"{first[option.name].file}:{first[option.name].line}"
            raise _refuse(option.file, option.line, f"option '{option.name}' is already defined at {where}")
        first[option.name] = option
    names = list(first)
    for option in options:
        for kind, pairs in (("beta", option.beta), ("delta", option.delta)):
            for other, _ in pairs:
                if other not in first:
                    text = f"option '{option.name}' has a {kind} for '{other}', which is no option"
                    raise _refuse(option.file, option.line, text + did_you_mean(other, names))


def _short(text: str, width: int = 60) -> str:
    shown = "".join(c if c.isprintable() else " " for c in text)
    return f"'{shown}'" if len(shown) <= width else f"'{shown[: width - 3]}...'"
