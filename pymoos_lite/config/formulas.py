"""Arithmetic over named numbers, as study files derive columns with: ``100 * a / (a + b)``.

Numbers, names, ``+ - * /``, signs and brackets; nothing else of Python is understood. A missing number, and
a division by zero, make the result missing.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

MAX_LENGTH = 1000


class FormulaError(ValueError):
    """The text is no formula."""


@dataclass(frozen=True)
class Formula:
    """A parsed formula; `names` are those it needs."""

    text: str
    names: tuple[str, ...]
    _tree: ast.expr

    def value(self, numbers: Mapping[str, float | None]) -> float | None:
        """Its value, None if a number is missing, or it divides by zero or overflows."""
        try:
            found = _value(self._tree, numbers)
        except (_MissingError, ZeroDivisionError, OverflowError):
            return None
        return found if isfinite(found) else None


class _MissingError(Exception):
    pass


def parse_formula(text: str) -> Formula:
    """Read a formula.

    Raises:
        FormulaError: it holds something else than numbers, names, ``+ - * /`` and brackets.
    """
    if len(text) > MAX_LENGTH:
        raise FormulaError(f"a formula of {len(text)} characters is longer than {MAX_LENGTH}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        names: dict[str, None] = {}
        _check(tree, names)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, FormulaError):
            raise
        raise FormulaError(f"'{text}' is no formula: expected e.g. 100 * a / (a + b)") from None
    return Formula(text.strip(), tuple(names), tree)


def _check(node: ast.expr, names: dict[str, None]) -> None:
    match node:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div(), right=right):
            _check(left, names)
            _check(right, names)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            _check(operand, names)
        case ast.Name(id=name):
            names[name] = None
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            pass
        case _:
            raise FormulaError("a formula has numbers, names, + - * / and brackets only")


def _value(node: ast.expr, numbers: Mapping[str, float | None]) -> float:
    match node:
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _value(left, numbers), _value(right, numbers)
            if isinstance(op, ast.Add):
                return a + b
            if isinstance(op, ast.Sub):
                return a - b
            return a * b if isinstance(op, ast.Mult) else a / b
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, numbers)
            return -value if isinstance(op, ast.USub) else value
        case ast.Name(id=name):
            found = numbers.get(name)
            if found is None:
                raise _MissingError(name)
            return found
        case ast.Constant(value=int() | float() as value):
            return float(value)
    raise AssertionError(node)
