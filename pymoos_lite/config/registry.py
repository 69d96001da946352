"""Finds apps and behaviours by name: ours, the names MOOS-IvP users know, and third parties'.

Built-in names live in `catalogue` as text, so that listing them imports nothing. An installed
package adds its own through the entry-point groups ``pymoos_lite.apps`` and ``ivp_helm.behaviors``;
a mission adds the Python files of its own folder.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import ModuleType

from pymoos_lite.config.catalogue import APPS, BEHAVIORS, Entry
from pymoos_lite.config.problems import did_you_mean

APP_GROUP = "pymoos_lite.apps"
BEHAVIOR_GROUP = "ivp_helm.behaviors"


class UnknownNameError(LookupError):
    """No app or behaviour of that name is known; the text names the nearest one."""


@dataclass(frozen=True)
class Registry:
    """A table from names (in any case) to classes, loaded when asked for."""

    noun: str
    entries: tuple[Entry, ...]

    def find(self, name: str) -> Entry | None:
        """The entry of that name or alias, None if there is none."""
        wanted = name.lower()
        for entry in reversed(self.entries):  # later ones (third parties, the mission) win
            if wanted == entry.name.lower() or wanted in (a.lower() for a in entry.aliases):
                return entry
        return None

    def load(self, name: str) -> type:
        """The class of that name.

        Raises:
            UnknownNameError: there is none.
            ImportError: its module or class cannot be imported.
        """
        entry = self.find(name)
        if entry is None:
            raise UnknownNameError(f"there is no {self.noun} '{name}'{did_you_mean(name, self.names())}")
        return load_target(entry.target)

    def names(self) -> list[str]:
        return [n for entry in self.entries for n in (entry.name, *entry.aliases)]

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)


def load_target(target: str) -> type:
    """The class that ``module:Class`` names.

    Raises:
        ImportError: no such module or class.
    """
    module_name, _, attribute = target.partition(":")
    module = importlib.import_module(module_name)
    try:
        found = getattr(module, attribute)
    except AttributeError:
        raise ImportError(f"{module_name} has no class {attribute}") from None
    assert isinstance(found, type)
    return found


def apps(folder: Path | None = None) -> Registry:
    """All apps: built in, installed, and in the mission's `folder`."""
    return Registry("app", (*APPS, *_installed(APP_GROUP), *_in_folder(folder, "MOOS_NAME")))


def behaviors(folder: Path | None = None) -> Registry:
    """All behaviours: built in, installed, and in the mission's `folder`."""
    return Registry("behavior", (*BEHAVIORS, *_installed(BEHAVIOR_GROUP), *_in_folder(folder, "BHV_NAME")))


def _installed(group: str) -> list[Entry]:
    found = []
    for point in metadata.entry_points(group=group):
        found.append(Entry(point.name, point.value, doc=f"from {point.value.partition(':')[0]}"))
    return found


def _in_folder(folder: Path | None, marker: str) -> Iterable[Entry]:
    """Entries for the classes in `folder`'s Python files that name themselves with `marker`.

    A class says which name a mission file calls it by: ``BHV_NAME = "BHV_HoldDepth"`` or
    ``MOOS_NAME = "pMyApp"``.
    """
    if folder is None or not folder.is_dir():
        return
    for path in sorted(folder.glob("*.py")):
        if path.name.startswith("_") or marker not in path.read_text(encoding="utf-8", errors="replace"):
            continue
        module = import_file(path)
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__ and marker in vars(value):
                name = vars(value)[marker]
                yield Entry(name, f"{module.__name__}:{value.__name__}", doc=f"from {path.name}")


def import_file(path: Path) -> ModuleType:
    """Import a Python file by path, once.

    Raises:
        ImportError: the file cannot be imported; the text names it.
    """
    wanted = str(path.resolve())
    for module in list(sys.modules.values()):
        if getattr(module, "__file__", None) == wanted:
            return module
    name = "mission_plugins_" + "".join(
        c if c.isalnum() else "_" for c in str(path.resolve().with_suffix(""))
    )
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise ImportError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise ImportError(f"{path}: {type(error).__name__}: {error}") from error
    return module
