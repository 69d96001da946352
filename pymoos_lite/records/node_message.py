"""NODE_MESSAGE: one posting sent from vessel to vessel (marine_apps.md 10), and its ACK_MESSAGE."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.text import num, parse_bool, parse_number
from pymoos_lite.records.csp import MAX_TEXT, RecordError, clip, field_map

_RECORD = "NODE_MESSAGE"


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class NodeMessage:
    """A variable and its value, addressed to vessels by name and group.

    `dest_node` is a name, a colon list of names or `all`; `value` is a number, text, or None, which
    receivers deliver as number 0. Text that looks like a number stays text.
    """

    src_node: str
    var_name: str
    value: float | str | None = None
    dest_node: str = ""
    dest_group: str = ""
    src_app: str = ""
    src_bhv: str = ""
    color: str = ""
    ack: bool = False
    ack_id: str = ""

    @classmethod
    def parse(cls, text: str) -> NodeMessage:
        """Record from text; keys in any case and order, unknown keys ignored.

        Raises RecordError when it is not `k=v,k=v`, lacks src_node, var_name or any destination, has
        both values, or a double_val that is not a number.
        """
        return _parse_cached(text) if len(text) <= _CACHED_LENGTH else _parse(text)

    def destinations(self) -> tuple[str, ...]:
        """Names of dest_node's colon list, blanks and empty names dropped; `all` stays one name."""
        return tuple(name for name in (part.strip() for part in self.dest_node.split(":")) if name)

    def is_for_all(self) -> bool:
        """True when either address is `all`, in any case."""
        return self.dest_node.lower() == "all" or self.dest_group.lower() == "all"

    def names(self, node: str) -> bool:
        """True when dest_node is `all` or lists this node; vessel names compare without case."""
        wanted = node.lower()
        return any(name.lower() in ("all", wanted) for name in self.destinations())

    def to_text(self, *, mark_quoted: bool = False) -> str:
        """`src_node=abe,dest_node=ben,...,string_val=bar`, fields in the stock order, unset ones left out.

        Text with commas, quotes or outer blanks is enclosed in quotes; `mark_quoted` then also appends
        the helm's `string_val_quoted=true`. A value that is not finite is left out.
        """
        parts = []
        if self.ack_id:
            parts.append(f"ack_id={_plain(self.ack_id)}")
        if self.ack:
            parts.append("ack=true")
        for key in ("src_node", "dest_node", "dest_group", "src_app", "src_bhv", "var_name", "color"):
            value = getattr(self, key)
            if value:
                parts.append(f"{key}={_plain(value)}")
        if isinstance(self.value, str):
            text = self.value
            if "," in text or '"' in text or text != text.strip():
                parts.append(f'string_val="{text}"')
                if mark_quoted:
                    parts.append("string_val_quoted=true")
            else:
                parts.append(f"string_val={text}")
        elif self.value is not None and isfinite(self.value):
            parts.append(f"double_val={num(self.value, 6)}")
        return ",".join(parts)

    def __str__(self) -> str:
        return self.to_text()


# In lockstep every vessel of a fleet is handed the same text; records are immutable, so they can share one
# parse. Long texts are not worth the memory.
_CACHED_LENGTH = 4096


def _parse(text: str) -> NodeMessage:
    head, quoted = _cut_quoted_value(text)
    f = field_map(_RECORD, head)
    for needed in ("src_node", "var_name"):
        if not f.get(needed):
            raise RecordError(_RECORD, f"no {needed} in '{clip(text)}'")
    if not f.get("dest_node") and not f.get("dest_group"):
        raise RecordError(_RECORD, f"neither dest_node nor dest_group in '{clip(text)}'")
    string_val = quoted if quoted is not None else f.get("string_val")
    double_val = f.get("double_val")
    value: float | str | None = string_val
    if double_val is not None:
        if string_val is not None:
            raise RecordError(_RECORD, f"both string_val and double_val in '{clip(text)}'")
        value = parse_number(double_val)
        if value is None:
            raise RecordError(_RECORD, f"double_val must be a number, found '{clip(double_val)}'")
    return NodeMessage(
        src_node=f["src_node"],
        var_name=f["var_name"],
        value=value,
        dest_node=f.get("dest_node", ""),
        dest_group=f.get("dest_group", ""),
        src_app=f.get("src_app", ""),
        src_bhv=f.get("src_bhv", ""),
        color=f.get("color", ""),
        ack=parse_bool(f.get("ack", "")) is True,
        ack_id=f.get("ack_id", ""),
    )


_parse_cached = lru_cache(maxsize=1024)(_parse)


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class AckMessage:
    """ACK_MESSAGE: the receiver's answer to a message sent with `ack=true`; all three are names."""

    ack_id: str
    src: str
    dest: str

    @classmethod
    def parse(cls, text: str) -> AckMessage:
        """Record from `id=I, src=S, dest=D`; raises RecordError when one of them is missing."""
        f = field_map("ACK_MESSAGE", text)
        for needed in ("id", "src", "dest"):
            if not f.get(needed):
                raise RecordError("ACK_MESSAGE", f"no {needed} in '{clip(text)}'")
        return cls(f["id"], f["src"], f["dest"])

    def to_text(self) -> str:
        """`id=I, src=S, dest=D`."""
        return f"id={_plain(self.ack_id)}, src={_plain(self.src)}, dest={_plain(self.dest)}"

    def __str__(self) -> str:
        return self.to_text()


_KEYS = frozenset(
    [
        "ack_id",
        "ack",
        "src_node",
        "dest_node",
        "dest_group",
        "src_app",
        "src_bhv",
        "var_name",
        "color",
        "double_val",
        "string_val_quoted",
    ]
)
_QUOTED_VALUE = re.compile(r'(?:^|,)\s*string_val\s*=\s*"', re.IGNORECASE)


def _plain(value: str) -> str:
    """A name without the characters that would end its field early."""
    if value.isalnum():
        return value
    return "".join(c for c in value if c not in ',"{}').strip()


def _cut_quoted_value(text: str) -> tuple[str, str | None]:
    """(the text without its quoted string_val, that value), the value None when it is not quoted.

    The format has no escapes, so a value may hold quotes and commas of its own. Its closing quote is the
    last one that only further fields of this format follow: those are peeled off the end, each key once.
    """
    start = _QUOTED_VALUE.search(text)
    if start is None or len(text) > MAX_TEXT:
        return text, None
    body = text[start.end() :].rstrip()
    tail: dict[str, str] = {}
    while True:
        before, comma, piece = body.rpartition(",")
        key = piece.partition("=")[0].strip().lower()
        if not comma or key not in _KEYS or key in tail or piece.count('"') % 2:
            break
        tail[key] = piece
        body = before.rstrip()
    if not body.endswith('"'):
        return text, None
    head = text[: start.start()]
    return ",".join([head, *tail.values()]), body[:-1]
