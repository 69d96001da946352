"""The command line: ``pymoos COMMAND ...`` and ``pymoos-launch MISSION``.

Each command is a module with ``add_arguments(parser)`` and ``run(args) -> exit status``; only the
module of the command that was typed is imported, so that ``--help`` is instant.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

COMMANDS: dict[str, tuple[str, str]] = {
    "launch": ("pymoos_lite.tools.launch", "run a mission in real time (warped if asked)"),
    "sim": ("pymoos_lite.tools.sim", "run a mission in lockstep, as fast as the processor allows"),
    "monte": ("pymoos_lite.tools.monte", "run a study: many seeded runs of a mission, and what they say"),
    "check": ("pymoos_lite.tools.check", "say everything that is wrong with a mission, without running it"),
    "fleet": ("pymoos_lite.tools.fleet_command", "deploy, return, station or pause a running fleet"),
    "scope": ("pymoos_lite.tools.scope", "watch the variables of a running community"),
    "poke": ("pymoos_lite.tools.poke", "post values to a running community"),
    "log": ("pymoos_lite.tools.log_tools", "grep, scan and plot log files"),
    "helm": ("ivp_helm.helm_tool", "explain the helm's decisions, live or from a log"),
    "ivp": ("ivp_helm.ivp_tool", "draw objective functions and their sum"),
    "bloom": ("missions.bloom.figures_tool", "draw the bloom mission, from logs or a study's results"),
    "opinion": ("opinion_engine.opinion_tool", "predict and draw opinion dynamics"),
    "nsplug": ("pymoos_lite.tools.nsplug", "expand the macros of a mission file"),
    "compile": ("pymoos_lite.tools.compile", "compile the hot modules with this machine's C compiler"),
    "list": ("pymoos_lite.tools.catalog", "list apps, behaviours or missions"),
    "help": ("pymoos_lite.tools.manual", "the parameters of an app or a behaviour"),
}

INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] in ("-h", "--help"):
        words = []
    if not words:
        print(usage())
        return 0
    if words[0] in ("--version", "-V"):
        from importlib.metadata import version

        print(f"pymoos-lite {version('pymoos-lite')}")
        return 0
    name, *rest = words
    if name not in COMMANDS:
        from pymoos_lite.config.problems import did_you_mean

        print(
            f"pymoos: there is no command '{name}'{did_you_mean(name, COMMANDS)} (see pymoos --help)",
            file=sys.stderr,
        )
        return 2
    return run_command(name, rest, f"pymoos {name}")


def launch_main(arguments: Sequence[str] | None = None) -> int:
    """``pymoos-launch``: the same as ``pymoos launch``."""
    return run_command("launch", list(sys.argv[1:] if arguments is None else arguments), "pymoos-launch")


def run_command(name: str, arguments: Sequence[str], program: str) -> int:
    """Import the module of command `name`, parse `arguments` and run it."""
    module_name, summary = COMMANDS[name]
    module = importlib.import_module(module_name)
    parser = argparse.ArgumentParser(
        prog=program, description=summary[0].upper() + summary[1:] + ".", allow_abbrev=False
    )
    module.add_arguments(parser)
    options = parser.parse_args(arguments)
    try:
        return int(module.run(options) or 0)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()  # the reader went away (`| head`): not an error worth a traceback
        return 0


def usage() -> str:
    """The text of ``pymoos --help``."""
    width = max(len(name) for name in COMMANDS)
    lines = [f"  {name:<{width}}  {summary}" for name, (_, summary) in COMMANDS.items()]
    return "\n".join(
        (
            "usage: pymoos COMMAND ...",
            "",
            "Marine autonomy for MOOS-IvP missions, and fleets that choose together.",
            "",
            "commands:",
            *lines,
            "",
            "pymoos COMMAND --help explains a command; pymoos list missions shows what can be launched.",
        )
    )


if __name__ == "__main__":
    sys.exit(main())
