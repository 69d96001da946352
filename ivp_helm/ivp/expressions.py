"""Functions written as one line of text, for trying builders out.

    peak(course, 270, basewidth=180, wrap=True)
    100 * couple(peak(course, 90, basewidth=180, wrap=True), spd(speed, 2, 1, 3, 40, 40), 60, 40)
    200 * reflect("speed * cos(radians(course - 45))", uniform_amount=600) + leq(depth, 20, 5)

`number * function` sets the priority weight, `+` puts functions beside each other. The text is taken
apart with `ast` and only what is named here is ever called: it can be given by a stranger.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ivp_helm.ivp.coupler import couple
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError, nearest_spelling
from ivp_helm.ivp.function import IvPFunction
from ivp_helm.ivp.reflector import reflect
from ivp_helm.ivp.zaic import Peak, zaic_hdg, zaic_heq, zaic_leq, zaic_peak, zaic_spd, zaic_vector

MAX_TEXT: Final = 10_000
MAX_DEPTH: Final = 40

_MATHS: Final[dict[str, Callable[..., Any]]] = {
    "abs": np.abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "arctan2": np.arctan2,
    "hypot": np.hypot,
    "radians": np.radians,
    "degrees": np.degrees,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "min": np.minimum,
    "max": np.maximum,
    "clip": np.clip,
    "where": np.where,
}
_OPERATIONS: Final[dict[type[ast.AST], Callable[..., Any]]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Mod: np.mod,
    ast.Pow: np.power,
    ast.USub: np.negative,
    ast.UAdd: np.positive,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}
_PEAK_FIELDS: Final = ("summit", "peakwidth", "basewidth", "summitdelta", "minutil", "maxutil")


def parse_functions(domain: Domain, text: str) -> list[IvPFunction]:
    """The functions an expression stands for, over (parts of) `domain`.

    Raises `IvPError` for anything that is no such expression, and whatever the builders refuse.
    """
    tree = _tree(text)
    found = _build(domain, tree, text)
    if not isinstance(found, list):
        raise IvPError(f"expression {text!r}: is a {type(found).__name__}, not a function")
    return [f if f.context else f.labelled(_context(text, len(found), i)) for i, f in enumerate(found)]


def _context(text: str, count: int, i: int) -> str:
    short = " ".join(text.split())
    short = short if len(short) <= 40 else short[:37] + "..."
    return short if count == 1 else f"{i + 1}. of {short}"


def _tree(text: str) -> ast.expr:
    if len(text) > MAX_TEXT:
        raise IvPError(f"expression of {len(text)} characters is longer than {MAX_TEXT}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise IvPError(f"expression {text[:60]!r}: {error.args[0] if error.args else 'too deep'}") from None
    if _depth(tree) > MAX_DEPTH:
        raise IvPError(f"expression {text[:60]!r}: nested more than {MAX_DEPTH} deep")
    return tree


def _depth(tree: ast.AST) -> int:
    deepest, todo = 0, [(tree, 1)]
    while todo:
        node, depth = todo.pop()
        deepest = max(deepest, depth)
        todo += [(child, depth + 1) for child in ast.iter_child_nodes(node)]
    return deepest


def _build(domain: Domain, node: ast.expr, text: str) -> Any:
    match node:
        case ast.Constant(value=value) if isinstance(value, (int, float, str, bool)):
            return value
        case ast.Name(id=name):
            return name
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_number(_build(domain, operand, text), text)
        case ast.List(elts=items) | ast.Tuple(elts=items):
            return tuple(_build(domain, item, text) for item in items)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            sides = (_functions(_build(domain, side, text), text) for side in (left, right))
            return [f for side in sides for f in side]
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            weight = _number(_build(domain, left, text), text)
            return [f.weighted(weight) for f in _functions(_build(domain, right, text), text)]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords):
            return _call(domain, name, args, keywords, text)
    raise IvPError(f"expression {text[:60]!r}: {ast.unparse(node)[:40]!r} is not understood")


def _call(domain: Domain, name: str, args: list[ast.expr], keywords: list[ast.keyword], text: str) -> Any:
    values = [_build(domain, a, text) for a in args]
    options = {}
    for keyword in keywords:
        if keyword.arg is None:
            raise IvPError(f"expression {text[:60]!r}: ** is not understood")
        options[keyword.arg] = _build(domain, keyword.value, text)
    builders: dict[str, Callable[..., IvPFunction]] = {
        "peak": _peak,
        "leq": zaic_leq,
        "heq": zaic_heq,
        "hdg": zaic_hdg,
        "spd": zaic_spd,
        "vector": zaic_vector,
    }
    try:
        if name in builders:
            return [builders[name](domain, *values, **options)]
        if name == "couple":
            parts = [f for value in values[:2] for f in _functions(value, text)]
            if len(parts) != 2:
                raise IvPError(f"expression {text[:60]!r}: couple takes two functions, not {len(parts)}")
            return [couple(parts[0], parts[1], *values[2:], domain=domain, **options)]
        if name == "reflect":
            return [_reflect(domain, *values, **options)]
    except IvPError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise IvPError(f"expression {text[:60]!r}: {name}: {str(error).splitlines()[0]}") from None
    known = [*builders, "couple", "reflect"]
    hint = nearest_spelling(name, known) or f"; there are {', '.join(known)}"
    raise IvPError(f"expression {text[:60]!r}: no builder {name!r}{hint}")


def _peak(domain: Domain, variable: str, *numbers: float, **options: Any) -> IvPFunction:
    fields = dict(zip(_PEAK_FIELDS, numbers, strict=False))
    fields |= {k: options.pop(k) for k in _PEAK_FIELDS if k in options}
    return zaic_peak(domain, variable, Peak(**fields), **options)


def _reflect(domain: Domain, formula: str, build_info: str = "", **options: Any) -> IvPFunction:
    tree = _tree(str(formula))
    names = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)} - _MATHS.keys() - {"pi"}
    scope = domain.subdomain([n for n in domain.names if n in names] or domain.names[:1])
    for name in sorted(names):
        domain.position(name)  # an unknown name is refused here

    def function(*columns: Any) -> Any:
        with np.errstate(all="ignore"):  # a value that is not finite is refused by the reflector
            return _calculate(tree, dict(zip(scope.names, columns, strict=True)), formula)

    return reflect(scope, function, build_info, **options)


def _calculate(node: ast.expr, values: dict[str, Any], text: str) -> Any:
    match node:
        case ast.Constant(value=value) if isinstance(value, (int, float)):
            return float(value)
        case ast.Name(id="pi"):
            return math.pi
        case ast.Name(id=name) if name in values:
            return values[name]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            return _OPERATIONS[type(op)](_calculate(left, values, text), _calculate(right, values, text))
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATIONS:
            return _OPERATIONS[type(op)](_calculate(operand, values, text))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _OPERATIONS:
            return _OPERATIONS[type(op)](_calculate(left, values, text), _calculate(right, values, text))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _MATHS:
            try:
                return _MATHS[name](*(_calculate(a, values, text) for a in args))
            except (TypeError, ValueError) as error:
                raise IvPError(f"formula {text!r}: {name}: {str(error).splitlines()[0]}") from None
    raise IvPError(f"formula {text!r}: {ast.unparse(node)[:40]!r} is not understood")


def _functions(value: Any, text: str) -> list[IvPFunction]:
    if isinstance(value, list):
        return value
    raise IvPError(f"expression {text[:60]!r}: {value!r} is not a function")


def _number(value: Any, text: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    raise IvPError(f"expression {text[:60]!r}: {value!r} is not a number")
