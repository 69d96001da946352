"""The message: one value of one variable, who said it and when.

Everything that moves between apps is a `Message`. It is a tuple, so it is immutable, cheap to
make, compared with ``==`` and packed by msgpack without conversion (community.md 5).
"""

from __future__ import annotations

from typing import NamedTuple

Value = float | str | bytes
"""What a variable can hold: a double, a string or a binary string."""

KIND_LETTER: dict[type, str] = {float: "D", str: "S", bytes: "B"}
KIND_NAME: dict[type, str] = {float: "double", str: "string", bytes: "binary"}


class Message(NamedTuple):
    """One post of one variable.

    `time` is mission time in seconds (unix seconds times the warp), `source` the name of the app
    that posted it, `aux` free text about the origin inside that app (the helm puts
    ``iteration:behaviour`` there), `community` where it was first posted; it is kept when bridged.
    """

    name: str
    value: Value
    time: float
    source: str
    aux: str = ""
    community: str = ""

    @property
    def kind(self) -> str:
        """``D``, ``S`` or ``B``."""
        return KIND_LETTER[type(self.value)]

    @property
    def number(self) -> float | None:
        """The value as a number: a double as it is, numeric text converted, else None."""
        value = self.value
        if isinstance(value, float):
            return value
        if isinstance(value, str):
            try:
                return float(value)
            except ValueError:
                return None
        return None

    @property
    def text(self) -> str:
        """The value as text; a double in its shortest exact form, binary as its size."""
        value = self.value
        if isinstance(value, str):
            return value
        if isinstance(value, bytes):
            return f"*binary* {len(value)} B"
        return repr(value)

    @property
    def origin(self) -> str:
        """``source`` or ``source:aux``, as logs show it."""
        return f"{self.source}:{self.aux}" if self.aux else self.source


def as_value(value: object) -> Value:
    """Turn what an app author hands to ``notify`` into a `Value`.

    Integers become doubles and booleans the words ``true`` and ``false``, which is what `.bhv`
    conditions compare with. Numpy scalars follow their Python kind.

    Raises:
        TypeError: the value is none of number, boolean, text or bytes.
    """
    kind = type(value)
    if kind is float or kind is str or kind is bytes:
        return value  # type: ignore[return-value]
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, bytearray | memoryview):
        return bytes(value)
    if isinstance(value, str):
        return str(value)
    if isinstance(value, bytes):
        return bytes(value)
    if kind.__name__ == "bool_" or kind.__name__ == "bool":  # numpy's boolean, without importing numpy
        return "true" if value else "false"
    if hasattr(value, "__float__"):
        return float(value)
    raise TypeError(f"a variable holds a number, text or bytes, not {kind.__name__}")
