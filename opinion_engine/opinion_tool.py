"""`pymoos opinion`: predict what a set of options will do, and draw opinion dynamics.

pymoos opinion design fleet.opt --mission meta_vehicle.moos --bias explore=90
pymoos opinion behaviors fleet.opt meta_vehicle.bhv
pymoos opinion pitchfork --out pitchfork.png       (also simplex, attention, basins, cascade; figures: all)
pymoos opinion simplex LOG_ABE LOG_BEN --out opinions.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from opinion_engine.model import Attention
    from opinion_engine.scenario import FleetHistory

FIGURES = {
    "simplex": "trajectories of a fleet's three opinions on the simplex, at the paper's zoom",
    "attention": "attention of a fleet and number of vessels heard, against time",
    "pitchfork": "bifurcation diagrams: predicted branches over simulated points",
    "basins": "which end a start leads to",
    "cascade": "contact sheet of a cascade on a line, a ring and a random geometric graph",
}
FROM_LOGS = ("simplex", "attention")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the sub-commands; imports nothing heavy."""
    commands = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    design = commands.add_parser("design", help="say in words and numbers what an option file will do")
    design.add_argument("options", nargs="+", type=Path, metavar="FILE.opt", help="option files, in order")
    design.add_argument(
        "--mission", type=Path, metavar="FILE.moos", help="take pOpinionManager's block from here"
    )
    design.add_argument("--agents", type=int, default=8, metavar="N", help="size of the fleet (default 8)")
    design.add_argument(
        "--graph", choices=("all", "line", "ring", "star"), default="all", help="who hears whom (default all)"
    )
    design.add_argument(
        "--bias", action="append", default=[], metavar="OPTION=RAW", help="a raw input every agent always has"
    )
    design.add_argument(
        "--model", choices=("paper", "reference"), help="which variant (default the mission's, or paper)"
    )
    for name, unit in (("tau_u", "seconds"), ("min_attention", ""), ("max_attention", ""), ("u_th", "")):
        text = f"as in pOpinionManager{', ' + unit if unit else ''}"
        design.add_argument(f"--{name.replace('_', '-')}", dest=name, type=float, metavar="X", help=text)
    table = commands.add_parser("behaviors", help="which behaviours each option activates, from a .bhv file")
    table.add_argument("options", type=Path, metavar="FILE.opt")
    table.add_argument("behaviors", type=Path, metavar="FILE.bhv")
    table.add_argument(
        "--assume", action="append", default=[], metavar="VAR=VALUE", help="a value that holds all the time"
    )
    for name, text in FIGURES.items():
        one = commands.add_parser(name, help=text)
        if name in FROM_LOGS:
            one.add_argument(
                "logs", nargs="*", metavar="LOG", help=".alog files or log folders, one per vessel"
            )
        if name == "cascade":
            one.add_argument(
                "--gif", type=Path, metavar="FILE", help="also write the random graph's as an animation"
            )
        one.add_argument(
            "--out", type=Path, default=Path(f"{name}.png"), metavar="FILE", help="image to write"
        )
        one.add_argument("--seed", type=int, default=1, help="of everything random (default 1)")
    every = commands.add_parser("figures", help="all figures into one folder")
    every.add_argument("--folder", type=Path, default=Path("figures"), metavar="DIR", help="default figures")
    every.add_argument("--seed", type=int, default=1, help="of everything random (default 1)")


def run(args: argparse.Namespace) -> int:
    """Do it; 0, or 1 with one line on what is wrong."""
    from opinion_engine.model import OpinionError
    from pymoos_lite.config.problems import ConfigurationError
    from pymoos_lite.tools.log_reading import LogError

    try:
        if args.what == "design":
            print(_design(args))
        elif args.what == "behaviors":
            return _behaviors(args)
        elif args.what == "figures":
            args.folder.mkdir(parents=True, exist_ok=True)
            for name in FIGURES:
                _draw(name, args.folder / f"{name}.png", args.seed)
            _animate(args.folder / "cascade.gif", args.seed)
        else:
            _draw(args.what, args.out, args.seed, tuple(getattr(args, "logs", ())))
            if getattr(args, "gif", None) is not None:
                _animate(args.gif, args.seed)
    except (OpinionError, ConfigurationError, LogError) as error:
        print(error, file=sys.stderr)
        return 1
    except (OSError, ValueError) as error:
        # A picture that cannot be written, or whose ending names no image format.
        print(f"pymoos opinion: {error}", file=sys.stderr)
        return 1
    return 0


def _pairs(texts: list[str], what: str) -> dict[str, str]:
    from opinion_engine.model import OpinionError

    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name or not value:
            raise OpinionError(f"{what} {text!r}: expected NAME=VALUE")
        found[name] = value
    return found


def _design(args: argparse.Namespace) -> str:
    from opinion_engine import design
    from opinion_engine.option_file import read_options
    from opinion_engine.reach import Setting

    block = _mission_block(args.mission) if args.mission else None
    setting = Setting(
        agents=args.agents,
        topology=args.graph,
        attention=_attention(args, block),
        opinion_thresh=block.opinion_thresh if block else 0.1,
        social_tick=block.socialtick if block else 1.0,
        biases=design.biases_from(_pairs(args.bias, "--bias")),
    )
    model = args.model or (block.model if block else "paper")
    return design.report(read_options(args.options), setting, model)


def _attention(args: argparse.Namespace, block: Any) -> Attention:
    """From the command line, else the mission's block, else the app's defaults."""
    from opinion_engine.model import Attention

    plain = Attention()
    names = {
        "tau_u": plain.tau_u,
        "min_attention": plain.u_min,
        "max_attention": plain.u_max,
        "u_th": plain.y_th,
    }
    values = {}
    for name, default in names.items():
        given = getattr(args, name)
        values[name] = given if given is not None else getattr(block, name) if block else default
    order = block.satfunorder if block else plain.n
    return Attention(values["tau_u"], values["min_attention"], values["max_attention"], values["u_th"], order)


def _mission_block(path: Path) -> Any:
    """The bound parameters of pOpinionManager's block in a mission file or template.

    Raises ConfigurationError for a file without one, and for values that are out of range.
    """
    from opinion_engine.app import OpinionManager
    from pymoos_lite.config.moos_file import parse_mission
    from pymoos_lite.config.problems import ConfigurationError, Problem

    mission = parse_mission(path.read_text(encoding="utf-8", errors="replace"), str(path))
    block = mission.block("pOpinionManager")
    if block is None:
        raise ConfigurationError(Problem(str(path), 0, "there is no ProcessConfig = pOpinionManager"))
    # A template's macros are not known here: their parameters keep the app's defaults, and the reader is
    # told.
    lines = [line for line in block.lines if "$(" not in line.value]
    left = ", ".join(line.key for line in block.lines if "$(" in line.value)
    if left:
        print(f"{path}: {left} left open by the template, taken at the app's defaults", file=sys.stderr)
    bound = OpinionManager.PARAMETERS.bind(lines, "pOpinionManager", str(path))
    for problem in bound.problems:
        if problem.severity == "error":
            raise ConfigurationError(problem)
    return bound.values


def _behaviors(args: argparse.Namespace) -> int:
    from ivp_helm.behavior_file import read_behavior_file
    from opinion_engine.activation import derive
    from opinion_engine.option_file import read_options

    options = read_options([args.options])
    file = read_behavior_file(
        args.behaviors.read_text(encoding="utf-8", errors="replace"), str(args.behaviors)
    )
    for problem in file.errors:
        print(problem, file=sys.stderr)
    found = derive(file, options, _pairs(args.assume, "--assume"))
    print(found.table())
    return 1 if file.errors else 0


def _draw(name: str, out: Path, seed: int, logs: tuple[str, ...] = ()) -> None:
    from opinion_engine import studies

    if name in FROM_LOGS:
        story = _from_logs(logs) if logs else None
        study = studies.simplex_study if name == "simplex" else studies.attention_study
        made = study(story, seed)
    else:
        draw: dict[str, Callable[[int], Figure]] = {
            "pitchfork": studies.pitchfork_study,
            "basins": studies.basin_study,
            "cascade": studies.cascade_study,
        }
        made = draw[name](seed)
    made.savefig(out)
    print(f"{out}: {FIGURES[name]}")


def _animate(out: Path, seed: int) -> None:
    from opinion_engine import plots, studies

    _, graph, t, x = studies.cascade_runs(seed)[-1]
    plots.cascade_animation(graph, t, x, str(out))
    print(f"{out}: the cascade on the random geometric graph")


def _from_logs(logs: tuple[str, ...]) -> FleetHistory:
    from opinion_engine.fleet_log import fleet_history
    from pymoos_lite.records.alog import read_entries
    from pymoos_lite.tools.log_reading import find_log, read_log

    return fleet_history({_vessel(find_log(log)): read_entries(read_log(log)) for log in logs})


def _vessel(path: Path) -> str:
    """`abe` for LOG_ABE_20_6_2024____.alog, else the file's name without its ending."""
    words = path.name.partition(".")[0].split("_")
    return (words[1] if len(words) > 1 and words[0] == "LOG" and words[1] else words[0]).lower()
