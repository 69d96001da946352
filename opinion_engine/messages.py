"""Opinion messages: the text form, the compact binary form, and the neighbour's dominant option (gcid.md 7,
8).

The one place where opinions are turned into bytes or characters and back. Input is untrusted: anything that
is not exactly a message raises `MessageError`, and sizes are bounded.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from mypy_extensions import mypyc_attr

from opinion_engine.model import OpinionError

Encoding = Literal["text", "i8", "i16", "f32"]
ENCODINGS: tuple[Encoding, ...] = ("text", "i8", "i16", "f32")
BYTES_PER_OPTION = {"i8": 1, "i16": 2, "f32": 4}

Z0 = 0.1  # below this the companding is nearly linear
Z_MAX = 128.0  # the largest opinion the integer forms can carry
MAX_TEXT = 10_000  # node comms' own limit on a message
MAX_FIELDS = 66  # name, group and as many options as an option file may have
MAX_OPINION = 1e9  # nothing plausible is larger; keeps sums and squares finite

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z", re.ASCII)
_HEADER_VERSION = 1


class MessageError(OpinionError):
    """A text or payload that is not an opinion message; the reason in one sentence."""


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class OpinionMessage:
    """What one neighbour says: its name, group, and opinions by (lower case) option name."""

    vname: str
    group: str
    opinions: Mapping[str, float]

    def dominant(self, threshold: float) -> str | None:
        """The option that decides this neighbour's list: '' when undecided, None for an empty record.

        Options in alphabetical order, each at least as large as the best so far (from 0.0) taking its place,
        so ties go to the last; the winner must be above `threshold` (gcid.md 7).
        """
        if not self.opinions:
            return None
        best, name = 0.0, ""
        for option in sorted(self.opinions):
            if self.opinions[option] >= best:
                best, name = self.opinions[option], option
        return name if best > threshold else ""


def format_text(
    vname: str, group: str, names: Sequence[str], z: Sequence[float], active: Sequence[bool] | None = None
) -> str:
    """`<vname>:<group>:<option>=<value>:...`, lower case, 4 decimals, active options only, in order.

    A ':' follows every active option that is not the last of the full list.
    """
    last = len(names) - 1
    parts = [f"{vname}:{group}:"]
    for j, name in enumerate(names):
        if active is None or active[j]:
            parts.append(f"{name}={z[j]:.4f}" if j == last else f"{name}={z[j]:.4f}:")
    return "".join(parts).lower()


def parse_text(text: str) -> OpinionMessage:
    """The record of a text message. Raises MessageError for anything else."""
    if len(text) > MAX_TEXT:
        raise MessageError(f"opinion message of {len(text)} characters, at most {MAX_TEXT} are read")
    return _parse_text(text)


@lru_cache(maxsize=256)
def _parse_text(text: str) -> OpinionMessage:
    # Kept, because in lockstep every vessel of a fleet is told the same.
    fields = text.split(":", MAX_FIELDS + 1)
    if len(fields) > 1 and fields[-1] == "":
        fields.pop()
    if len(fields) < 2:
        raise MessageError("opinion message without 'name:group'")
    if len(fields) > MAX_FIELDS:
        raise MessageError(f"opinion message with more than {MAX_FIELDS} fields")
    vname, group = fields[0].strip(), fields[1].strip()
    if not vname or not group:
        raise MessageError("opinion message with an empty name or group")
    opinions: dict[str, float] = {}
    for position, part in enumerate(fields[2:], start=3):
        name, equals, number = (piece.strip() for piece in part.partition("="))
        if not equals or not name or not _NUMBER.match(number):
            raise MessageError(f"opinion message, field {position}: expected 'option=number'")
        value = float(number)
        if not abs(value) <= MAX_OPINION:
            raise MessageError(f"opinion message, field {position}: the opinion is out of range")
        opinions[name.lower()] = value
    return OpinionMessage(vname, group, opinions)


def _half_away(x: float) -> int:
    return int(math.copysign(math.floor(abs(x) + 0.5), x))


def encode_binary(z: Sequence[float], encoding: Encoding, active: Sequence[bool] | None = None) -> bytes:
    """N_O values of 1, 2 or 4 bytes, big-endian, in option order; sender and time come from the carrier.

    i8, i16: q = round(Q asinh(z / Z0) / asinh(Z_MAX / Z0)), Q = 127 or 32767, clipped; -(Q + 1) = inactive.
    f32: IEEE single precision, NaN = inactive.
    """
    n = len(z)
    on = [True] * n if active is None else [bool(a) for a in active]
    if any(on[j] and not math.isfinite(z[j]) for j in range(n)):
        raise MessageError("cannot send an opinion that is not a finite number")
    if encoding == "f32":
        limit = float(np.finfo(np.float32).max)
        values = [min(max(float(z[j]), -limit), limit) if on[j] else math.nan for j in range(n)]
        return struct.pack(f">{n}f", *values)
    if encoding not in ("i8", "i16"):
        raise MessageError(f"'{encoding}' is no binary encoding: use i8, i16 or f32")
    top = 127 if encoding == "i8" else 32767
    scale = top / math.asinh(Z_MAX / Z0)
    q = [
        min(max(_half_away(scale * math.asinh(z[j] / Z0)), -top), top) if on[j] else -top - 1
        for j in range(n)
    ]
    return struct.pack(f">{n}{'b' if encoding == 'i8' else 'h'}", *q)


def decode_binary(payload: bytes, n_options: int, project: bool = True) -> tuple[list[float], list[bool]]:
    """(opinions, active) of a payload of N_O * 1, 2 or 4 bytes; inactive opinions are 0.

    With `project` the mean over the active options is subtracted, which restores the zero sum. Raises
    MessageError for any other length and for values out of range.
    """
    if n_options < 1 or len(payload) not in (n_options, 2 * n_options, 4 * n_options):
        n = n_options
        raise MessageError(
            f"payload of {len(payload)} bytes for {n} options, expected {n}, {2 * n} or {4 * n}"
        )
    width = len(payload) // n_options
    if width == 4:
        values = list(struct.unpack(f">{n_options}f", payload))
        active = [not math.isnan(v) for v in values]
        if any(a and not abs(v) <= MAX_OPINION for v, a in zip(values, active, strict=True)):
            raise MessageError("payload with an opinion out of range")
        z = [v if a else 0.0 for v, a in zip(values, active, strict=True)]
    else:
        top = 127 if width == 1 else 32767
        q = struct.unpack(f">{n_options}{'b' if width == 1 else 'h'}", payload)
        scale = math.asinh(Z_MAX / Z0) / top
        active = [value != -top - 1 for value in q]
        z = [Z0 * math.sinh(value * scale) if a else 0.0 for value, a in zip(q, active, strict=True)]
    if project and any(active):
        mean = sum(z) / sum(active)
        z = [v - mean if a else 0.0 for v, a in zip(z, active, strict=True)]
    return z, active


def add_header(payload: bytes, n_options: int, agent: int) -> bytes:
    """The payload behind its optional 2-byte header: version, width code and N_O, then the agent's number
    0..255.
    """
    if not 0 < n_options < 16 or len(payload) % n_options:
        raise MessageError(f"a header can announce 1 to 15 options, not {n_options} in {len(payload)} bytes")
    if not 0 <= agent <= 255:
        raise MessageError(f"agent number {agent}, expected 0 to 255")
    code = {1: 0, 2: 1, 4: 2}.get(len(payload) // n_options)
    if code is None:
        raise MessageError(f"payload of {len(payload)} bytes for {n_options} options")
    return bytes((_HEADER_VERSION << 6 | code << 4 | n_options, agent)) + payload


def split_header(data: bytes, n_options: int) -> tuple[int, bytes]:
    """(agent number, payload) of a message with header. Raises MessageError if it announces anything else."""
    if len(data) < 2:
        raise MessageError(f"message of {len(data)} bytes is shorter than its header")
    version, code, options = data[0] >> 6, data[0] >> 4 & 3, data[0] & 15
    if version != _HEADER_VERSION or code == 3:
        raise MessageError(
            f"header version {version}, width code {code}: expected version 1 and code 0, 1 or 2"
        )
    if options != n_options:
        raise MessageError(f"message about {options} options, this agent has {n_options}")
    if len(data) - 2 != options << code:
        raise MessageError(f"payload of {len(data) - 2} bytes, the header announces {options << code}")
    return data[1], data[2:]
