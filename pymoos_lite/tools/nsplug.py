"""`nsplug IN OUT [options] [MACRO=VALUE ...]`: expand a mission template (community.md 2.1).

The command line of the reference, with its exit statuses; files may also stand after the options.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pymoos_lite.config.macros import Expansion, Macros, ReadFile, expand, parse_macro_lines

HELP = """\
usage: nsplug IN OUT [options] [MACRO=VALUE ...] [MACRO ...]

Expands #include, #define, #ifdef and $(MACRO) of a mission template IN into the file OUT.

  -f, --force           overwrite OUT without asking
  -s, --strict          an undefined macro is an error (exit status 1, nothing is written)
  -l, --lenient         expand the defined macros of a line that also has undefined ones
  -p D, --path=D[:D2]   look for includes in these directories too (repeatable)
  --macros=FILE         read NAME=VALUE lines (repeatable)
  -x, --xfile           prefer IN with an x at the end of its name (meta_vehicle.moosx)
  --tag=NAME            take only the part below '<tag> NAME' of IN
  -i, --interactive     ask whether to go on when a macro is undefined
  -I, --impatient       the same, and stop for any answer but y
  -t, --terminal        write to the terminal; OUT may be left out
  -h, --help  -v, --version  -m, --manual

Macros in the text: $(X) value, %(X) upper case, $(X=d) d if undefined, $(X:=d) d if undefined or empty.
Directives: #include FILE [<tag>], #define NAME [VALUE], #ifdef A [value] [|| B] [&& C], #ifndef A [B],
#elseifdef, #else, #endif; '<tag> NAME' starts a part of a file.
"""


class UsageError(Exception):
    """A command line that cannot be followed; prints as one line."""


class _Request:
    """What the command line asks for. Macro files are read while going left to right: order matters."""

    def __init__(self, arguments: Sequence[str]) -> None:
        self.files: list[str] = []
        self.macros: Macros = {}
        self.paths: list[str] = []
        self.tag: str | None = None
        self.force = self.strict = self.lenient = self.xfile = False
        self.interactive = self.impatient = self.terminal = False
        rest = list(arguments)
        while rest:
            self.take(rest.pop(0), rest)
        needed = 1 if self.terminal else 2
        if len(self.files) < needed:
            what = ("an input file", "an output file")[len(self.files)]
            raise UsageError(f"{what} must be provided: nsplug IN OUT [options] [MACRO=VALUE ...]")

    def take(self, word: str, rest: list[str]) -> None:
        switches = {
            "-f": "force", "--force": "force", "-s": "strict", "--strict": "strict",
            "-l": "lenient", "--lenient": "lenient", "-x": "xfile", "--xfile": "xfile",
            "-i": "interactive", "--interactive": "interactive",
            "-I": "impatient", "--impatient": "impatient",
            "-t": "terminal", "--terminal": "terminal",
        }  # fmt: skip
        name, equals, value = word.partition("=")
        if word in switches:
            setattr(self, switches[word], True)
        elif name in ("--path", "-p"):
            if not equals and not rest:
                raise UsageError(f"{word} needs a directory")
            self.paths += [d for d in (value if equals else rest.pop(0)).split(os.pathsep) if d]
        elif name == "--macros" and equals:
            self.read_macros(value)
        elif name == "--tag" and equals:
            self.tag = value.strip().removeprefix("<").removesuffix(">")
        elif word.startswith("-"):
            raise UsageError(f"unknown option {word}; nsplug --help lists them")
        elif equals:
            if not name:
                raise UsageError(f"expected MACRO=VALUE, found {word}")
            self.macros[name] = value
        elif len(self.files) < 2:
            self.files.append(word)
        else:
            self.macros[word] = None

    def read_macros(self, name: str) -> None:
        text = _read_text(Path(name))
        if text is None:
            raise UsageError(f"cannot read the macro file {name}")
        self.macros, problems = parse_macro_lines(text, name, self.macros)
        for problem in problems:
            print(problem, file=sys.stderr)
        if any(p.severity == "error" for p in problems):
            raise UsageError(f"the macro file {name} cannot be used")


def _read_text(path: Path) -> str | None:
    try:
        # Bytes that are no UTF-8 travel through unchanged; line ends are kept as they are.
        return path.read_bytes().decode("utf-8", errors="surrogateescape")
    except (OSError, ValueError):
        return None


def file_reader(paths: Sequence[str], home: Path = Path()) -> ReadFile:
    """A function for `expand` that looks for an include below `home`, then below each of `paths`."""

    def read(name: str) -> tuple[str, str] | None:
        for folder in (home, *(Path(p) for p in paths)):
            try:
                candidate = folder / name
                if candidate.is_file() and (text := _read_text(candidate)) is not None:
                    return str(candidate), text
            except (OSError, ValueError):  # a name that no file can have
                continue
        return None

    return read


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """For `pymoos nsplug`: everything is handed to the same reader as for the stand-alone command."""
    # Options of nsplug are not argparse's to judge, so no word may look like an option to it.
    parser.prefix_chars = "\0"
    parser.add_argument(
        "arguments", nargs="*", help="IN OUT [options] [MACRO=VALUE ...]; --help lists the options"
    )


def run(args: argparse.Namespace) -> int:
    return main(args.arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run nsplug; returns the exit status: 0, or 1 when nothing could be written."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or any(w in ("-h", "--help", "-m", "--manual", "-w", "--web") for w in words):
        print(HELP, end="")
        return 0 if words else 1
    if any(w in ("-v", "--version") for w in words):
        print(f"nsplug of pymoos-lite {_version()}")
        return 0
    try:
        return _expand_files(_Request(words))
    except UsageError as refusal:
        print(f"nsplug: {refusal}", file=sys.stderr)
        return 1


def _version() -> str:
    try:
        return version("pymoos-lite")
    except PackageNotFoundError:
        return "(not installed)"


def _expand_files(request: _Request) -> int:
    source = request.files[0]
    if request.xfile and Path(source + "x").is_file():
        source += "x"
    text = _read_text(Path(source))
    if text is None:
        raise UsageError(f"cannot read the input file {source}")
    target = request.files[1] if len(request.files) > 1 else None
    if request.terminal:
        # With --terminal no output file is needed, so a second bare word may have been meant as one: it is.
        target = None
    result = expand(
        text,
        source,
        request.macros,
        file_reader(request.paths),
        strict=request.strict,
        lenient=request.lenient,
        tag=request.tag,
    )
    for problem in result.problems:
        print(problem, file=sys.stderr)
    if result.errors or not _go_on(request, result):
        print(f"nsplug: {target or 'nothing'} not written", file=sys.stderr)
        return 1
    if target is None:
        sys.stdout.write(result.text.encode("utf-8", "surrogateescape").decode("utf-8", "replace"))
        return 0
    return _write(Path(target), result.text, request.force)


def _go_on(request: _Request, result: Expansion) -> bool:
    if not result.undefined or not (request.interactive or request.impatient):
        return True
    answer = _ask("Macros are undefined. Go on? " + ("(y/N) " if request.impatient else "(Y/n) "))
    if answer is None:
        return False
    return answer == "y" if request.impatient else answer not in ("n", "no")


def _ask(question: str) -> str | None:
    try:
        return input(question).strip().lower()
    except EOFError:
        return None


def _write(target: Path, text: str, force: bool) -> int:
    if target.exists() and not force:
        answer = _ask(f"{target} exists. Replace? (y/N) ")
        if answer not in ("y", "yes"):
            print(f"nsplug: {target} left as it was", file=sys.stderr)
            return 0
    try:
        target.write_bytes(text.encode("utf-8", errors="surrogateescape"))
    except OSError as refusal:
        raise UsageError(f"cannot write {target}: {refusal.strerror or refusal}") from None
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
