"""`pymoos ivp`: draw what behaviours want, and what they decide together.

Inputs are builder expressions, encoded functions as text or in a file, and the BHV_IPF messages of a log.
Heavy imports wait until `run`, so that asking for help stays quick.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ivp_helm.ivp import Domain, IvPFunction

DESCRIPTION = "Draw objective functions, alone and summed, with the decision they lead to."
EXAMPLES = """examples:
  pymoos ivp "peak(course, 270, basewidth=180, wrap=True)"
  pymoos ivp "100*couple(peak(course,90,0,180,wrap=True), spd(speed,2,1,3,40,40))" "50*leq(speed,1.5,1)"
  pymoos ivp "reflect('speed*cos(radians(course-45))', uniform_amount=600)" -o closing.png
  pymoos ivp "H,3,1:a,1,2,0,100,D,speed;0;4;21,G,20,F,0,12,10.,13,20,30."
  pymoos ivp alpha.alog --list
  pymoos ivp alpha.alog --time 120.5 --behavior waypt_survey

builders: peak leq heq hdg spd vector couple reflect; number * function sets the weight, + adds functions
"""
DEFAULT_DOMAIN = "course,0,359,360:speed,0,4,41:depth,0,100,101"
MAX_LINE = 1_000_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the tool's arguments on a parser (the command line mounts it as `pymoos ivp`)."""
    parser.description = DESCRIPTION
    parser.epilog = EXAMPLES
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "inputs", nargs="+", metavar="INPUT", help="builder expression, encoded function, text file, or .alog"
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("ivp.png"), help="picture to write (ivp.png)")
    parser.add_argument(
        "-d", "--domain", help="domain for expressions, e.g. course,0,359,360:speed,0,4,21 (course to depth)"
    )
    parser.add_argument("--sum", action="store_true", dest="only_sum", help="draw the sum only")
    parser.add_argument("--behavior", action="append", help="of a log: this behavior only (may be repeated)")
    when = parser.add_mutually_exclusive_group()
    when.add_argument("--time", type=float, help="of a log: the iteration nearest this time (default: last)")
    when.add_argument("--iteration", type=int, help="of a log: this helm iteration")
    parser.add_argument("--list", action="store_true", help="of a log: list what it holds, draw nothing")
    parser.add_argument("--dpi", type=int, default=110, help="dots per inch of the picture (110)")


def run(args: argparse.Namespace) -> int:
    """Do what the arguments ask; returns the exit status (0, or 1 with one line on standard error)."""
    from ivp_helm.ivp import IvPError

    try:
        return _run(args)
    except (IvPError, OSError) as error:
        print(f"pymoos ivp: {error}", file=sys.stderr)
        return 1


def _run(args: argparse.Namespace) -> int:
    from ivp_helm.ivp import Domain, IvPError
    from ivp_helm.ivp.draw import draw

    if not 20 <= args.dpi <= 1000:
        raise IvPError(f"--dpi {args.dpi} is not 20 to 1000")
    given = Domain.parse(args.domain or DEFAULT_DOMAIN)
    functions: list[IvPFunction] = []
    title = ""
    for text in args.inputs:
        if text.lower().endswith(".alog"):
            log = Log(_lines(Path(text)))
            if args.list:
                _print_list(text, log)
                continue
            iteration = log.choose(args.time, args.iteration)
            functions += log.functions(iteration, args.behavior)
            title = f"{Path(text).name}, helm iteration {iteration}, time {log.times[iteration]:g}"
        elif text.lstrip().startswith("H,"):
            functions += _decoded([text], "argument")
        elif _is_file(text):
            functions += _decoded([line for line in _lines(Path(text)) if line.strip()], text)
        else:
            functions += _expression(given, text)
    if args.list:
        return 0
    if not functions:
        raise IvPError("nothing to draw: the inputs hold no functions")
    figure = draw(functions, only_sum=args.only_sum, title=title)
    figure.savefig(args.out, dpi=args.dpi)
    print(f"{args.out}: {len(functions)} function(s)")
    return 0


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):
        return False


def _expression(domain: Domain, text: str) -> list[IvPFunction]:
    from ivp_helm.ivp.expressions import parse_functions

    return parse_functions(domain, text)


def _decoded(texts: Iterable[str], where: str) -> list[IvPFunction]:
    from ivp_helm.ivp import IvPError, decode

    functions = []
    for number, text in enumerate(texts, 1):
        try:
            functions.append(decode(text, any_decimals=True))
        except IvPError as error:
            raise IvPError(f"{where}:{number}: {error}") from None
    return functions


def _lines(path: Path) -> Iterator[str]:
    with path.open(encoding="utf-8", errors="replace") as lines:
        yield from lines


def _print_list(name: str, log: Log) -> None:
    print(f"{name}: {len(log.times)} helm iterations with functions, {log.refused} message(s) refused")
    for iteration, time in log.times.items():
        print(f"{iteration:8d}  time {time:10.2f}  {' '.join(log.texts[iteration])}")


class Log:
    """The functions in the BHV_IPF messages of a log, by helm iteration and behavior.

    Reads lines of the form `time variable source value`; those that hold no BHV_IPF are passed over,
    damaged messages are counted in `refused`.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        from ivp_helm.ivp import IvPError, Joiner

        self.texts: dict[int, dict[str, str]] = {}
        self.times: dict[int, float] = {}
        self.refused = 0
        joiner = Joiner(patience=60.0)
        for line in lines:
            if "BHV_IPF" not in line or len(line) > MAX_LINE:
                continue
            fields = line.rstrip("\r\n").split(None, 3)
            if len(fields) < 4 or not fields[1].startswith("BHV_IPF"):
                continue
            try:
                time = float(fields[0])
                joined = joiner.add(fields[3], time, fields[2])
            except (IvPError, ValueError):
                self.refused += 1
                continue
            if joined is None:
                continue
            behavior, _, number = joined.id.rpartition("^")
            if not behavior or not number.isdigit():
                self.refused += 1
                continue
            self.texts.setdefault(int(number), {}).setdefault(behavior, joined.text)
            self.times.setdefault(int(number), joined.time)

    def choose(self, time: float | None, iteration: int | None) -> int:
        """The iteration asked for, nearest in time, or the last."""
        from ivp_helm.ivp import IvPError

        if not self.texts:
            raise IvPError("the log holds no complete BHV_IPF message (was the helm told to post them?)")
        if iteration is not None:
            if iteration not in self.texts:
                known = f"{min(self.texts)} to {max(self.texts)}"
                raise IvPError(f"no functions of iteration {iteration}; there are {known}")
            return iteration
        if time is not None:
            return min(self.times, key=lambda i: abs(self.times[i] - time))
        return max(self.texts)

    def functions(self, iteration: int, behaviors: list[str] | None) -> list[IvPFunction]:
        """The decoded functions of one iteration, in order of behavior name."""
        from ivp_helm.ivp import IvPError
        from ivp_helm.ivp.errors import nearest_spelling

        texts = self.texts[iteration]
        for name in behaviors or ():
            if name not in texts:
                hint = nearest_spelling(name, texts) or f"; there are {', '.join(sorted(texts))}"
                raise IvPError(f"iteration {iteration} has no function of behavior {name!r}{hint}")
        wanted = sorted(behaviors or texts)
        return [f for name in wanted for f in _decoded([texts[name]], f"{name}^{iteration}")]


def main() -> int:
    """Run the tool by itself: python -m ivp_helm.ivp_tool."""
    parser = argparse.ArgumentParser(prog="pymoos ivp")
    add_arguments(parser)
    return run(parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
