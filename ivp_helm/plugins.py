"""Behaviour classes by type name: built in, installed, and from the folders of a mission (helm.md 11.5).

A plug-in file is imported only when a type that it mentions is asked for, so that a broken one hurts only
the missions that use it.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ivp_helm.behavior import Behavior
from pymoos_lite.config.problems import did_you_mean
from pymoos_lite.config.registry import behaviors, import_file, load_target

MARKER = "BHV_NAME"


class BehaviorFinder:
    """Gives the class of a type name. A plug-in of a mission's folder goes before a built-in type."""

    def __init__(self, folders: Iterable[Path] = ()) -> None:
        self._registry = behaviors()
        self._files: dict[Path, str] = {}
        for folder in folders:
            if folder.is_dir():
                for path in sorted(folder.glob("*.py")):
                    text = path.read_text(encoding="utf-8", errors="replace")
                    if MARKER in text and not path.name.startswith("_"):
                        self._files[path] = text

    def __call__(self, kind: str) -> type[Behavior]:
        """The class for `kind`.

        Raises:
            LookupError: there is none, or two folders have one each; the text says which is meant or near.
            ImportError: its file or module cannot be imported; the text names file and cause.
        """
        found: dict[Path, type[Behavior]] = {}
        for path, text in self._files.items():
            if f'"{kind}"' in text or f"'{kind}'" in text:
                cls = _class_in(path, kind)
                if cls is not None:
                    found[path] = cls
        if len(found) > 1:
            raise LookupError(f"behavior '{kind}' is defined twice: {' and '.join(str(p) for p in found)}")
        if found:
            return next(iter(found.values()))
        entry = self._registry.find(kind)
        if entry is None:
            names = self._registry.names()
            raise LookupError(f"there is no behavior '{kind}'{did_you_mean(kind, names)}")
        try:
            cls = load_target(entry.target)
        except ImportError as error:
            raise ImportError(f"behavior '{kind}' cannot be loaded from {entry.target}: {error}") from error
        if not issubclass(cls, Behavior):
            raise ImportError(f"behavior '{kind}': {entry.target} is no subclass of Behavior")
        return cls


def _class_in(path: Path, kind: str) -> type[Behavior] | None:
    module = import_file(path)
    for value in vars(module).values():
        if isinstance(value, type) and issubclass(value, Behavior) and vars(value).get(MARKER) == kind:
            return value
    return None
