"""APPCAST reports, and the requests that make apps send them (community.md 10).

An app's status page travels as one line with `!@#` between fields and `!@` between the lines of a field.
When an app posts, and how it counts its warnings, is the app's business; this is only the format.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pymoos_lite.geometry.text import num, parse_number
from pymoos_lite.records.csp import MAX_TEXT, RecordError, clip, field_map

_FIELD = "!@#"
_LINE = "!@"
_RULE = "=" * 62
_EVENT_RULE = "=" * 67
_MAX_DURATION = 30.0


@dataclass(frozen=True, slots=True)
class AppCast:
    """An app's status page.

    `messages` are the lines of the report's body; `events` oldest first; `run_warnings` pairs of text
    and count, whose total `run_warning_total` may exceed (retired texts are no longer listed).
    """

    proc: str
    iteration: int = 0
    node: str = ""
    messages: tuple[str, ...] = ()
    config_warnings: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    events_total: int = 0
    run_warnings: tuple[tuple[str, int], ...] = ()
    run_warning_total: int = 0

    @classmethod
    def parse(cls, text: str) -> AppCast:
        """Record from an APPCAST line; unknown fields are ignored, message lines keep leading blanks.

        Raises RecordError when there is no `proc`, a counter is no number, or the text is too long.
        """
        if len(text) > MAX_TEXT:
            raise RecordError("APPCAST", f"text of {len(text)} characters is longer than {MAX_TEXT}")
        f: dict[str, str] = {}
        for piece in text.split(_FIELD):
            key, equals, value = piece.partition("=")
            if equals:
                f[key.strip()] = value
        if not f.get("proc", "").strip():
            raise RecordError("APPCAST", f"no proc in '{clip(text)}'")
        return cls(
            proc=f["proc"].strip(),
            iteration=_counter(f, "iter"),
            node=f.get("node", "").strip(),
            messages=_lines(f.get("messages", "")),
            config_warnings=_lines(f.get("config_warnings", "")),
            events=_lines(f.get("events", "")),
            events_total=_counter(f, "events_total"),
            run_warnings=tuple(_counted(line) for line in _lines(f.get("run_warnings", ""))),
            run_warning_total=_counter(f, "run_warning_total"),
        )

    def to_text(self) -> str:
        """The one-line form. `iter` stands twice and empty lists leave their separator, as readers expect.

        Text that would break the line apart is altered as little as possible: line breaks become separate
        message lines (blanks elsewhere), a separator inside a text gets a blank, and so does a leading `#`.
        """
        iteration = f"iter={self.iteration}"
        body = "".join(
            [_safe(part) + _LINE for line in self.messages for part in (line.splitlines() or [""])]
        )
        parts = [f"proc={_safe(self.proc)}", iteration]
        if self.node:
            parts.append(f"node={_safe(self.node)}")
        parts += [
            iteration,
            f"messages={body}",
            _joined("config_warnings", self.config_warnings),
            f"events_total={self.events_total}",
            _joined("events", self.events),
            f"run_warning_total={self.run_warning_total}",
            _joined("run_warnings", [f"{count}:{text}" for text, count in self.run_warnings]),
        ]
        return _FIELD.join(parts)

    __str__ = to_text

    def to_terminal(self) -> str:
        """The page as a person reads it in a terminal, 62 columns wide, newest event first."""
        title = f"{self.proc} {self.node}".rstrip()
        state = f"{len(self.config_warnings)}/{self.run_warning_total}({self.iteration})"
        out = [_RULE, title + state.rjust(max(62 - len(title), len(state) + 1)), _RULE]
        if self.config_warnings:
            total = len(self.config_warnings)
            out.append(f"Configuration Warnings: {total}")
            out += [f" [{i} of {total}]: {text}" for i, text in enumerate(self.config_warnings, 1)]
            out.append("")
        if self.run_warnings:
            out.append(f"Runtime Warnings: {self.run_warning_total}")
            out += [f" [{count}]: {text}" for text, count in self.run_warnings]
            out.append("")
        out += self.messages
        if self.events:
            out += ["", _EVENT_RULE, f"Most Recent Events ({len(self.events)}):", _EVENT_RULE]
            out += reversed(self.events)
        return "\n".join(out)


@dataclass(frozen=True, slots=True)
class AppCastRequest:
    """APPCAST_REQ: `key` asks the app(s) for appcasts during the next `duration` MOOS seconds.

    node and app name one or `all`; thresh is `any` (always) or `run_warning` (on a new warning only).
    """

    node: str
    app: str
    duration: float
    key: str
    thresh: str = "any"

    @classmethod
    def parse(cls, text: str) -> AppCastRequest:
        """Record from text, duration clamped to 0..30; RecordError without a key or with bad values."""
        f = field_map("APPCAST_REQ", text)
        if not f.get("key"):
            raise RecordError("APPCAST_REQ", f"no key in '{clip(text)}'")
        thresh = f.get("thresh") or "any"
        if thresh not in ("any", "run_warning"):
            raise RecordError("APPCAST_REQ", f"thresh must be any or run_warning, found '{clip(thresh)}'")
        return cls(
            node=f.get("node", ""),
            app=f.get("app", ""),
            duration=_duration("APPCAST_REQ", f.get("duration", "0")),
            key=f["key"],
            thresh=thresh,
        )

    def asks(self, node: str, app: str) -> bool:
        """True when this app of this community is meant."""
        return self.node in ("all", node) and self.app in ("all", app)

    def to_text(self) -> str:
        """`node=abe,app=pHelmIvP,duration=3.0,key=uMAC:app,thresh=any`."""
        return (
            f"node={self.node},app={self.app},duration={_one_decimal(self.duration)},"
            f"key={self.key},thresh={self.thresh}"
        )

    __str__ = to_text


@dataclass(frozen=True, slots=True)
class LoadCastRequest:
    """LOADCAST_REQ: the named app (or `all`, `any`) posts iteration gap and length for `duration` seconds."""

    app: str
    duration: float
    thresh: str = ""

    @classmethod
    def parse(cls, text: str) -> LoadCastRequest:
        """Record from text, duration clamped to 0..30; RecordError without an app or with a bad duration."""
        f = field_map("LOADCAST_REQ", text)
        if not f.get("app"):
            raise RecordError("LOADCAST_REQ", f"no app in '{clip(text)}'")
        duration = _duration("LOADCAST_REQ", f.get("duration", "0"))
        return cls(app=f["app"], duration=duration, thresh=f.get("thresh", ""))

    def asks(self, app: str) -> bool:
        """True when this app is meant."""
        return self.app in ("all", "any", app)

    def to_text(self) -> str:
        """`app=pHelmIvP,thresh=any,duration=10.0`; thresh only when set."""
        thresh = f"thresh={self.thresh}," if self.thresh else ""
        return f"app={self.app},{thresh}duration={_one_decimal(self.duration)}"

    __str__ = to_text


def _one_decimal(seconds: float) -> str:
    text = num(seconds, 3)
    return text if "." in text else text + ".0"


def _duration(record: str, text: str) -> float:
    seconds = parse_number(text)
    if seconds is None:
        raise RecordError(record, f"duration must be a number of seconds, found '{clip(text)}'")
    return min(max(seconds, 0.0), _MAX_DURATION)


def _counter(f: dict[str, str], key: str) -> int:
    text = f.get(key, "0")
    number = parse_number(text)
    if number is None:
        raise RecordError("APPCAST", f"{key} must be a number, found '{clip(text)}'")
    return int(number)


def _lines(value: str) -> tuple[str, ...]:
    if value.endswith(_LINE):
        value = value[: -len(_LINE)]
    elif not value:
        return ()
    return tuple(value.split(_LINE))


def _counted(line: str) -> tuple[str, int]:
    count, colon, text = line.partition(":")
    if colon and count.isascii() and count.isdigit() and len(count) < 16:
        return text, int(count)
    return line, 1


def _safe(text: str) -> str:
    # `!@` before a leading `#` would read as the field separator.
    if text[:1] == "#":
        text = " " + text
    while _LINE in text:
        text = text.replace(_LINE, "! @")
    return text


def _joined(key: str, texts: Iterable[str]) -> str:
    lines = [_safe(" ".join(text.splitlines())) for text in texts]
    body = _LINE.join([line for line in lines if line])
    return f"{key}={body}" if body else ""
