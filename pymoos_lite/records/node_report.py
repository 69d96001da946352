"""NODE_REPORT: what a vessel says about itself, in its comma-separated and its JSON form.

Format and aliases are marine_apps.md 3.1. Parsing and printing happen many times a second for every
vessel of a fleet, hence the table-driven loop and the one-dictionary construction below.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.text import num, parse_number, plain_number, split_protected, unbrace
from pymoos_lite.records.csp import MAX_TEXT, RecordError, balanced, clip, printable

_RECORD = "NODE_REPORT"


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class NodeReport:
    """One vessel's state. None (text: "") means the report does not say.

    x, y, depth, altitude, length, beam in metres; speed in m/s; heading and cog in degrees from north;
    yaw in radians, mathematical; lat, lon in degrees; time in MOOS seconds. `properties` holds every
    field the format does not name, as (key, value) sorted by key.
    """

    name: str = ""
    x: float | None = None
    y: float | None = None
    speed: float | None = None
    heading: float | None = None
    cog: float | None = None
    depth: float | None = None
    lat: float | None = None
    lon: float | None = None
    type: str = ""
    color: str = ""
    group: str = ""
    vsource: str = ""
    mode: str = ""
    mode_aux: str = ""
    allstop: str = ""
    load_warning: str = ""
    altitude: float | None = None
    speed_og: float | None = None
    heading_og: float | None = None
    index: int = 0
    thrust_mode_reverse: bool = False
    yaw: float | None = None
    time: float | None = None
    transparency: float | None = None
    length: float | None = None
    beam: float | None = None
    trajectory: str = ""
    properties: tuple[tuple[str, str], ...] = ()

    @classmethod
    def parse(cls, text: str) -> NodeReport:
        """Record from comma-separated or JSON text; raises RecordError, and nothing else, when it is neither.

        Unknown keys, and numeric keys whose value is no number, become properties. Completeness is a
        separate question: see `is_complete`.
        """
        return _parse_cached(text) if len(text) <= _CACHED_LENGTH else _parse(text)

    @classmethod
    def of(cls, values: dict[str, Any]) -> NodeReport:
        """The record with these fields, the others unset: the constructor in a tenth of its time."""
        # One dictionary update instead of thirty guarded attribute writes; unset fields fall back on
        # the class defaults, so equality, hashing and replace() see a normal frozen dataclass.
        report = cls.__new__(cls)
        report.__dict__.update(values)
        return report

    def is_complete(self) -> bool:
        """True when NAME, SPD, HDG and either X,Y or LAT,LON are present."""
        return (
            self.name != ""
            and self.speed is not None
            and self.heading is not None
            and (self.has_xy() or self.has_latlon())
        )

    def has_xy(self) -> bool:
        """True when both local coordinates are present."""
        return self.x is not None and self.y is not None

    def has_latlon(self) -> bool:
        """True when both geodetic coordinates are present."""
        return self.lat is not None and self.lon is not None

    def property(self, key: str, default: str = "") -> str:
        """Value of an extra field by its exact key."""
        for name, value in self.properties:
            if name == key:
                return value
        return default

    def to_text(self, riders: Iterable[tuple[str, str]] = ()) -> str:
        """Comma-separated text in the stock order; riders are extra fields printed last.

        Values that are not finite are left out: no reader could take them for numbers.
        """
        return ",".join([f"{key}={value}" for key, value in self._pairs(riders)])

    def __str__(self) -> str:
        return self.to_text()

    def to_json(self, riders: Iterable[tuple[str, str]] = ()) -> str:
        """The JSON form: the same fields as `to_text`, numbers bare, everything else quoted."""
        parts = []
        for key, value in self._pairs(riders):
            shown = (
                value
                if parse_number(value) is not None and _is_json_number(value)
                else json.dumps(value, ensure_ascii=False)
            )
            parts.append(f"{json.dumps(key, ensure_ascii=False)}:{shown}")
        return "{" + ",".join(parts) + "}"

    def _pairs(self, riders: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
        pairs: list[tuple[str, str]] = []
        held = self.__dict__
        for attribute, key, decimals in _PRINT_ORDER:
            value = held.get(attribute)
            if value is None or value == "":
                continue
            if decimals >= 0:
                if value - value == 0.0:
                    pairs.append((key, num(value, decimals)))
            elif decimals == _TEXT:
                pairs.append((key, _printable_cached(value)))
            elif decimals == _COUNT:
                if value:
                    pairs.append((key, str(value)))
            elif decimals == _TRUTH:
                if value:
                    pairs.append((key, "true"))
            else:
                pairs.append((key, "{" + balanced(value) + "}"))
        for extra in (self.properties, riders):
            for key, text in extra:
                pairs.append((key, printable(text)))
        return pairs


# Every reader in a community, and in lockstep every community, is handed the same text; records are
# immutable, so they can share one parse. Long texts are not worth the memory.
_CACHED_LENGTH = 4096


def _parse(text: str) -> NodeReport:
    if len(text) > MAX_TEXT:
        raise RecordError(_RECORD, f"text of {len(text)} characters is longer than {MAX_TEXT}")
    stripped = text.strip()
    braced = "{" in stripped or "}" in stripped
    if not braced:
        pairs = [piece.partition("=") for piece in stripped.split(",")]
    elif stripped.startswith("{") and stripped.endswith("}"):
        pairs = _json_pairs(stripped)
    else:
        pairs = [piece.partition("=") for piece in split_protected(stripped, quotes=False)]
    values: dict[str, Any] = {}
    extra: dict[str, str] = {}
    find = _READERS.get
    for key, equals, value in pairs:
        entry = find(key)
        if entry is not None and equals:
            # The way of nearly every field: a number without blanks, or text without braces (and so without
            # commas) that needs nothing but trimming.
            attribute, reader = entry
            if reader is parse_number:
                number = plain_number(value)
                if number is not None:
                    values[attribute] = number
                    continue
            elif reader is printable and not braced:
                values[attribute] = value.strip()
                continue
        key, value = key.strip(), value.strip()
        if not equals:
            if key:
                raise RecordError(_RECORD, f"expected KEY=value, found '{clip(key)}'")
            continue
        entry = _READERS.get(key) or _READERS.get(key.upper())
        if entry is None and ("{" in key or "}" in key):
            key = _clean_key(key)
            entry = _READERS.get(key.upper())
        if entry is not None:
            parsed = entry[1](value)
            if parsed is not None:
                values[entry[0]] = parsed
                continue
        if key:
            value = printable(value)
            if value:
                extra[key] = value
    if extra:
        values["properties"] = tuple(sorted(extra.items()))
    return NodeReport.of(values)


_parse_cached = lru_cache(maxsize=1024)(_parse)
# Names, types, colours, modes: a few short words that every report repeats.
_printable_cached = lru_cache(maxsize=1024)(printable)


# What stands in the decimals column for fields that are not decimal numbers.
_TEXT, _COUNT, _TRUTH, _BRACED = -1, -2, -3, -4

_PRINT_ORDER: tuple[tuple[str, str, int], ...] = (
    ("name", "NAME", _TEXT),
    ("x", "X", 2),
    ("y", "Y", 2),
    ("speed", "SPD", 2),
    ("heading", "HDG", 2),
    ("cog", "COG", 2),
    ("depth", "DEP", 2),
    ("lat", "LAT", 8),
    ("lon", "LON", 8),
    ("type", "TYPE", _TEXT),
    ("color", "COLOR", _TEXT),
    ("group", "GROUP", _TEXT),
    ("vsource", "VSOURCE", _TEXT),
    ("mode", "MODE", _TEXT),
    ("mode_aux", "MODE_AUX", _TEXT),
    ("allstop", "ALLSTOP", _TEXT),
    ("load_warning", "LOAD_WARNING", _TEXT),
    ("altitude", "ALTITUDE", 2),
    ("speed_og", "SPD_OG", 2),
    ("heading_og", "HDG_OG", 2),
    ("index", "INDEX", _COUNT),
    ("thrust_mode_reverse", "THRUST_MODE_REVERSE", _TRUTH),
    ("yaw", "YAW", 7),
    ("time", "TIME", 2),
    ("transparency", "TRANSPARENCY", 2),
    ("length", "LENGTH", 2),
    ("beam", "BEAM", 2),
    ("trajectory", "TRAJECTORY", _BRACED),
)


def _braced(value: str) -> str:
    return balanced(unbrace(value)).strip()


def _count(value: str) -> int | None:
    number = parse_number(value)
    return None if number is None else int(number)


def _truth(value: str) -> bool | None:
    return {"true": True, "false": False}.get(value.lower())


_KIND_READERS: dict[int, Callable[[str], Any]] = {
    _TEXT: printable,
    _COUNT: _count,
    _TRUTH: _truth,
    _BRACED: _braced,
}
_READERS: dict[str, tuple[str, Callable[[str], Any]]] = {
    key: (attribute, _KIND_READERS.get(decimals, parse_number)) for attribute, key, decimals in _PRINT_ORDER
}
for _alias, _key in (
    ("UTC_TIME", "TIME"),
    ("SPEED", "SPD"),
    ("HEADING", "HDG"),
    ("DEPTH", "DEP"),
    ("LEN", "LENGTH"),
    ("ALT", "ALTITUDE"),
):
    _READERS[_alias] = _READERS[_key]


def _is_json_number(text: str) -> bool:
    """True when a decimal text is legal JSON too: no plus, no leading zeros, no bare point."""
    try:
        json.loads(text)
    except ValueError:
        return False
    return True


def _clean_key(key: str) -> str:
    """A key without the characters that structure the text: it could not be printed with them."""
    return "".join(c for c in key if c not in ",={}").strip()


def _json_pairs(text: str) -> list[tuple[str, str, str]]:
    """(key, "=", value) of a JSON object, numbers kept as they were written.

    The reference writes braces inside JSON unquoted, so what is no JSON is read the way it reads it:
    quotes dropped, split at commas outside braces and at the first colon.
    """
    try:
        loaded = json.loads(text, parse_float=str, parse_int=str, parse_constant=str)
    except (ValueError, RecursionError):
        pairs = []
        for piece in split_protected(text[1:-1].replace('"', ""), quotes=False):
            key, colon, value = piece.partition(":")
            pairs.append((_clean_key(key), "=" if colon else "", value.strip()))
        return pairs
    return [(_clean_key(key), "=", _json_value(value)) for key, value in loaded.items()]


def _json_value(value: Any) -> str:
    if isinstance(value, str):
        return value.strip()
    if value is None:
        return ""
    try:
        return json.dumps(value)
    except RecursionError:
        raise RecordError(_RECORD, "JSON is nested too deeply") from None
