"""Settings of a command line put into a parsed mission: `--set NAME=VALUE`, pAntler's `--NAME=VALUE`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pymoos_lite.config.mission import KNOWN_GLOBALS, ConfigLine, MissionFile, key_name


def override(mission: MissionFile, settings: Mapping[str, str]) -> tuple[MissionFile, tuple[str, ...]]:
    """The mission with the settings put in, and the names that matched nothing (for an error message).

    A plain NAME replaces the value of every line of that key, inside blocks too (community.md 9), in any
    letter case; a known global that is absent is added. `APP.NAME` touches the block of that app only, where
    the line is added if missing. Lines that were added carry line number 0.
    """
    unmatched = []
    for setting, value in settings.items():
        app, dot, key = setting.rpartition(".")
        if dot:
            mission, hit = _override_in_block(mission, app, key, value)
        else:
            mission, hit = _override_everywhere(mission, key, value)
        if not hit:
            unmatched.append(setting)
    return mission, tuple(unmatched)


def _override_in_block(mission: MissionFile, app: str, key: str, value: str) -> tuple[MissionFile, bool]:
    target = mission.block(app)
    if target is None or not key_name(key):
        return mission, False
    lines = _replaced(target.lines, key, value) or (*target.lines, ConfigLine(key.strip(), value, 0))
    blocks = tuple(replace(b, lines=lines) if b is target else b for b in mission.blocks)
    return replace(mission, blocks=blocks), True


def _override_everywhere(mission: MissionFile, key: str, value: str) -> tuple[MissionFile, bool]:
    globals_ = _replaced(mission.globals, key, value)
    known = {key_name(name): name for name in KNOWN_GLOBALS}
    hit = bool(globals_)
    if not hit and key_name(key) in known:
        globals_ = (*mission.globals, ConfigLine(known[key_name(key)], value, 0))
        hit = True
    blocks = []
    for block in mission.blocks:
        lines = _replaced(block.lines, key, value)
        hit = hit or bool(lines)
        blocks.append(replace(block, lines=lines) if lines else block)
    return replace(mission, globals=globals_ or mission.globals, blocks=tuple(blocks)), hit


def _replaced(lines: tuple[ConfigLine, ...], key: str, value: str) -> tuple[ConfigLine, ...]:
    """The lines with every `key` set to `value`, or nothing when there is no such key."""
    wanted = key_name(key)
    if not any(entry.name == wanted for entry in lines):
        return ()
    return tuple(replace(entry, value=value) if entry.name == wanted else entry for entry in lines)
