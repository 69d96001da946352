"""Finds, reads and plans the mission that a person named."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from pymoos_lite.config.mission import MissionFile
from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.config.overrides import override
from pymoos_lite.config.problems import did_you_mean
from pymoos_lite.hosts.plan import CommunityPlan, plan_community


class MissionError(Exception):
    """The mission cannot be used; the text is one line that says what and where."""


def shipped_missions() -> dict[str, Path]:
    """Name to folder of the missions that are installed with us."""
    spec = importlib.util.find_spec("missions")
    places = list(spec.submodule_search_locations or []) if spec is not None else []
    found = {}
    for place in places:
        for folder in sorted(Path(place).iterdir()):
            if folder.is_dir() and any(folder.glob("*.moos")):
                found[folder.name] = folder
    return found


def find_mission(name: str) -> Path:
    """The `.moos` file meant by `name`: a file, a folder holding one, or a shipped mission's name.

    Raises:
        MissionError: nothing of that name, or a folder with several and none of the folder's name.
    """
    path = Path(name).expanduser()
    if path.is_file():
        return path
    folder = path if path.is_dir() else shipped_missions().get(name)
    if folder is None:
        hint = did_you_mean(name, shipped_missions())
        raise MissionError(
            f"{name}: no such mission file, and no mission of that name is installed{hint} "
            "(see pymoos list missions)"
        )
    own = folder / f"{folder.resolve().name}.moos"
    if own.is_file():
        return own
    files = sorted(folder.glob("*.moos"))
    if len(files) != 1:
        names = ", ".join(f.name for f in files) or "none"
        raise MissionError(f"{name}: which .moos file is meant? The folder has: {names}")
    return files[0]


def parse_settings(texts: Iterable[str]) -> dict[str, str]:
    """``NAME=VALUE`` texts as a dictionary.

    Raises:
        MissionError: one has no ``=`` or no name.
    """
    settings = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise MissionError(f"--set {text}: expected NAME=VALUE")
        settings[name.strip()] = value.strip()
    return settings


def load_plan(
    name: str, settings: Mapping[str, str] | None = None, only: Iterable[str] = ()
) -> CommunityPlan:
    """Find, read and plan a mission; its problems are in the plan.

    Raises:
        MissionError: the file cannot be found or read, or a setting matches nothing in it.
    """
    path = find_mission(name)
    mission = read_mission(path, settings or {})
    return plan_community(mission, path.resolve().parent, tuple(only))


def read_mission(path: Path, settings: Mapping[str, str]) -> MissionFile:
    """Read a `.moos` file with `settings` put in.

    Raises:
        MissionError: the file cannot be read, or a setting matches nothing in it.
    """
    mission, unmatched = override(parse_mission_file(path), settings)
    if unmatched:
        keys = [line.key for block in mission.blocks for line in block.lines]
        keys += [line.key for line in mission.globals]
        hint = did_you_mean(unmatched[0].rpartition(".")[2], keys)
        raise MissionError(f"--set {unmatched[0]}: {mission.file} has no line of that name{hint}")
    return mission


def parse_mission_file(path: Path) -> MissionFile:
    """Read a `.moos` file as it is.

    Raises:
        MissionError: it cannot be opened.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise MissionError(f"{path}: {error.strerror or error}") from None
    shown = shown_path(path)
    return replace(parse_mission(text, shown, dict(os.environ)), file=shown)


def shown_path(path: Path) -> str:
    """The path as a person in this folder would type it."""
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(path)
