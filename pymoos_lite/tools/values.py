"""Values as a person types them on a command line."""

from __future__ import annotations

from pymoos_lite.records.csp import is_number


def typed_value(text: str) -> str | float:
    """A double if `text` is a plain number, text without its quotes otherwise (community.md 19.1).

    >>> typed_value("2.5"), typed_value('"2.5"'), typed_value("true")
    (2.5, '2.5', 'true')
    """
    if is_number(text):
        return float(text)
    quoted = len(text) >= 2 and text[0] == text[-1] == '"'
    return text[1:-1] if quoted else text
