"""The text form in which functions travel in BHV_IPF, as stock viewers and log tools read it.

    H,<clen>,<context>,<dim>,<pieces>,<degree>,<weight>,D,<domain>,G,<g1>,..,F,<piece 1>,<piece 2>,...

Weights keep four decimals, so the text is for display and logs; a decision is never taken on a decoded
function. Packets are in packets.py. Source: ivp_math.md 9.
"""

from __future__ import annotations

import math
import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp.codec_kernels import write_pieces
from ivp_helm.ivp.domain import Domain, _number
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction

# Above this the four-decimal integer arithmetic of the writer would overflow.
MAX_MAGNITUDE: Final = 1e14
# No function of a helm comes near this; it bounds what a hostile text can make us allocate.
MAX_TEXT: Final = 64_000_000

_WHOLE: Final = re.compile(r"\d{1,10}")
_WEIGHT: Final = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_LONG_WEIGHT: Final = re.compile(r"[-+]?\d*\.\d{5,}")
_PLAIN: Final = re.compile(r"[0-9.,-]+")
_FIFTH_DECIMAL: Final = re.compile(r"\.\d{5}")


def encode(f: IvPFunction) -> str:
    """The function as text. Raises `IvPError` for a context with a comma or a weight below 0 (the form has
    neither), and for values beyond 1e14."""
    if "," in f.context or not f.context.isprintable():
        raise IvPError(f"context {f.context!r}: a comma or control character cannot be encoded")
    if f.weight < 0:
        raise IvPError(f"function {f.context!r}: weight {f.weight:g} below 0 cannot be encoded")
    if not float(np.abs(f.coefficients).max()) <= MAX_MAGNITUDE:
        raise IvPError(f"function {f.context!r}: values beyond {MAX_MAGNITUDE:g} cannot be encoded")
    head = f"H,{len(f.context)},{f.context},{len(f.domain)},{f.pieces},{f.degree},{_number(f.weight)}"
    domain = str(f.domain).replace(",", ";")
    grid = ",".join(str(edge - 1) for edge in f.grid)
    pieces = write_pieces(f._block, f.degree).tobytes().decode("ascii")
    return f"{head},D,{domain},G,{grid},F,{pieces}"


def decode(text: str, *, any_decimals: bool = False) -> IvPFunction:
    """Read the text form back.

    Everything is checked: announced counts, bounds within the domain, finite weights of at most four
    decimals (a fifth is the mark of a damaged text; `any_decimals` allows it). Exclusive bounds (`X3,7`)
    become inclusive ones. Raises `IvPError` saying which field is wrong.
    """
    if len(text) > MAX_TEXT:
        raise IvPError(f"encoded function: {len(text)} characters are more than {MAX_TEXT}")
    clen_text, comma, rest = text.strip()[2:].partition(",")
    if not text.lstrip().startswith("H,") or not comma:
        raise IvPError(f"encoded function: expected 'H,<length>,<context>,...', not {text[:30]!r}")
    clen = _whole(clen_text, "context length")
    if rest[clen : clen + 1] == ",":
        context, rest = rest[:clen], rest[clen + 1 :]
    else:  # the length is not to be trusted: the context ends at the next comma
        context, _, rest = rest.partition(",")
    fields = rest.split(",")
    if len(fields) < 6:
        raise IvPError(f"encoded function {context!r}: ends after {text[-20:]!r}; the header is incomplete")
    dim = _whole(fields[0], f"{context!r} number of variables")
    count = _whole(fields[1], f"{context!r} number of pieces")
    degree = _whole(fields[2], f"{context!r} degree")
    weight = _weight(fields[3], f"{context!r} priority weight")
    if weight < 0:
        raise IvPError(f"encoded function {context!r}: priority weight {weight:g} is below 0")
    if degree > 1:
        raise IvPError(f"encoded function {context!r}: degree {degree}; only 0 and 1 are known")
    if fields[4] != "D":
        raise IvPError(f"encoded function {context!r}: expected 'D' before the domain, not {fields[4]!r}")
    domain = Domain.parse(fields[5], separator=";")
    if dim != len(domain):
        raise IvPError(f"encoded function {context!r}: {dim} variable(s) announced, but domain {domain}")
    if len(fields) < 8 + dim or fields[6] != "G" or fields[7 + dim] != "F":
        raise IvPError(
            f"encoded function {context!r}: expected 'G', {dim} cell sizes and 'F' after the domain"
        )
    grid = []
    for name, points, field in zip(domain.names, domain.points, fields[7 : 7 + dim], strict=True):
        g = _whole(field, f"{context!r} grid cell of {name!r}")
        if g >= points:
            raise IvPError(
                f"encoded function {context!r}: grid cell {g} of {name!r} is not 0 to {points - 1}"
            )
        grid.append(g + 1)
    body = fields[8 + dim :]
    width = 2 * dim + degree * dim + 1
    if len(body) != count * width:
        raise IvPError(
            f"encoded function {context!r}: {count} pieces need {count * width} fields after 'F',"
            f" but there are {len(body)} (truncated, or split wrongly?)"
        )
    read = _read_plainly(body, count, dim, width)
    bounds, marks, weights = read or _read_carefully(body, count, dim, width, context, any_decimals)
    return IvPFunction(
        domain,
        bounds[:, 0::2],
        bounds[:, 1::2],
        weights,
        low_open=marks[:, 0::2],
        high_open=marks[:, 1::2],
        grid=grid,
        weight=weight,
        context=context,
    )


_Pieces = tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.float64]]


def _read_plainly(body: list[str], count: int, dim: int, width: int) -> _Pieces | None:
    """Bounds, marks and weights of a body that holds nothing but plain numbers; None if it may hold more."""
    text = ",".join(body)
    if not _PLAIN.fullmatch(text) or _FIFTH_DECIMAL.search(text):
        return None
    bounds = np.empty((count, 2 * dim), np.int64)
    weights = np.empty((count, width - 2 * dim))
    try:
        for i in range(2 * dim):
            bounds[:, i] = list(map(int, body[i::width]))
        for i in range(2 * dim, width):
            weights[:, i - 2 * dim] = list(map(float, body[i::width]))
    except (ValueError, OverflowError):
        return None
    return bounds, np.zeros(bounds.shape, np.bool_), weights


def _read_carefully(
    body: list[str], count: int, dim: int, width: int, context: str, any_decimals: bool
) -> _Pieces:
    """The same field by field, with exclusive bounds and exponents, and errors that name the field."""
    bounds = np.empty((count, 2 * dim), np.int64)
    marks = np.zeros((count, 2 * dim), np.bool_)
    weights = np.empty((count, width - 2 * dim))
    for p in range(count):
        piece = body[p * width : (p + 1) * width]
        for i in range(2 * dim):
            field = piece[i]
            if field.startswith("X"):
                marks[p, i] = True
                field = field[1:]
            bounds[p, i] = _whole(field, f"{context!r} piece {p} bound {i}")
        for i in range(2 * dim, width):
            where = f"{context!r} piece {p} weight {i - 2 * dim}"
            if not any_decimals and _LONG_WEIGHT.fullmatch(piece[i]):
                raise IvPError(f"encoded function {where}: {piece[i]!r} has more than four decimals")
            weights[p, i - 2 * dim] = _weight(piece[i], where)
    return bounds, marks, weights


def _whole(field: str, where: str) -> int:
    if not _WHOLE.fullmatch(field):
        raise IvPError(f"encoded function {where}: {field[:30]!r} is not a whole number")
    return int(field)


def _weight(field: str, where: str) -> float:
    number = float(field) if _WEIGHT.fullmatch(field) else math.nan
    if not math.isfinite(number):
        raise IvPError(f"encoded function {where}: {field[:30]!r} is not a finite number")
    return number
