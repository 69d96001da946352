"""The one error type of this library.

Everything the library refuses (a reversed domain, a piece outside its domain, a truncated packet) is
raised as `IvPError`, whose text says in one line what was wrong, where, and what would be right.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class IvPError(ValueError):
    """Something handed to the interval-programming library is not usable."""


def nearest_spelling(name: str, known: Iterable[str]) -> str:
    """A trailing "; did you mean 'x'?" when `known` holds something close to `name`, else ""."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""
