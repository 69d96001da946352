"""The hot modules as machine code: found here, made by `pymoos_lite.compiled.build`.

The same sources run either way, to the same bits. `FOLDER` beside the packages holds one shared library of all
compiled modules, a stub for each, and a manifest with the digests of the sources they were made from; one
changed source, and all of them run as Python again, so that an edit always takes effect. With PYMOOS_PURE=1
in the environment they run as Python anyway.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Sequence
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType

SWITCH = "PYMOOS_PURE"
ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "pymoos_lite_compiled"
SUFFIX = EXTENSION_SUFFIXES[0]
"""Of this Python's extension modules: several Pythons may share a folder."""
MANIFEST = f"manifest{SUFFIX}.json"
DOCSTRINGS = f"docstrings{SUFFIX}.json"


def digest(sources: Sequence[Path]) -> str:
    """One digest of all these files, whatever their line endings.

    Raises:
        OSError: one of them cannot be read.
    """
    total = hashlib.blake2b(digest_size=16)
    for source in sources:
        total.update(source.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return total.hexdigest()


def sources(modules: Sequence[str]) -> list[Path]:
    """The files that decide what is compiled: the builder's and those of the modules."""
    return [Path(__file__).with_name("build.py"), *map(source_of, modules)]


def source_of(module: str) -> Path:
    """The file of a module."""
    return ROOT.joinpath(*module.split(".")).with_suffix(".py")


class CompiledLoader(ExtensionFileLoader):
    """Gives classes back their docstrings, which the compiler drops: help pages are made of them."""

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        # Compiled modules load each other without asking a loader: see to those as well.
        waiting = _docstrings(Path(self.path).parent)
        for name in [name for name in waiting if name in sys.modules]:
            classes = {each: getattr(sys.modules[name], each, None) for each in waiting[name]}
            if None not in classes.values():  # else it is still loading
                for each, text in waiting.pop(name).items():
                    classes[each].__doc__ = text


class CompiledFinder(MetaPathFinder):
    """Finds the compiled form of a module as long as all sources are those it was made from."""

    def __init__(self, folder: Path) -> None:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        self.folder = folder
        self.modules: list[str] = manifest["modules"]
        self.library: str = manifest["library"]
        self._digest: str = manifest["digest"]
        self._names = frozenset((*self.modules, self.library))
        self._fresh: bool | None = None

    @property
    def is_fresh(self) -> bool:
        """Whether the sources are still those that were compiled; looked at once."""
        if self._fresh is None:
            try:
                self._fresh = digest(sources(self.modules)) == self._digest
            except OSError:
                self._fresh = False
        return self._fresh

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname not in self._names or not self.is_fresh:
            return None
        file = str(self.folder / (fullname + SUFFIX))
        return spec_from_file_location(fullname, file, loader=CompiledLoader(fullname, file))


def install() -> None:
    """Let imports find compiled modules, where there are any for this Python and nobody asked for plain ones."""
    if os.environ.get(SWITCH, "") in ("", "0") and _installed() is None:
        try:
            sys.meta_path.insert(0, CompiledFinder(FOLDER))
        except (OSError, ValueError, KeyError, TypeError):
            return  # never built here, or only half


def remove(folder: Path) -> None:
    """Take away what was built there for this Python. The manifest goes first: without it nothing else counts."""
    (folder / MANIFEST).unlink(missing_ok=True)
    for file in folder.glob("*" + SUFFIX + "*"):
        file.unlink()


def state() -> str:
    """In a few words, what runs: "compiled", "plain Python" and why."""
    if os.environ.get(SWITCH, "") not in ("", "0"):
        return f"plain Python ({SWITCH} is set)"
    finder = _installed()
    if finder is None:
        return "plain Python (never compiled: pymoos compile)"
    if not finder.is_fresh:
        return "plain Python (a source has changed since: pymoos compile)"
    return "compiled"


@cache
def _docstrings(folder: Path) -> dict[str, dict[str, str]]:
    """By module and class, of modules that did not get them yet."""
    found: dict[str, dict[str, str]] = json.loads((folder / DOCSTRINGS).read_text(encoding="utf-8"))
    return found


def _installed() -> CompiledFinder | None:
    return next((each for each in sys.meta_path if isinstance(each, CompiledFinder)), None)
