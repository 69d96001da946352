"""fleet.yaml: one file for a shoreside and all its vehicles.

    fleet: berta                       # a name, for people
    warp: 4
    seed: 1                            # of everything drawn below
    duration: 3600                     # mission seconds of a run in lockstep
    datum: {lat: 43.8253, lon: -70.3304}
    macros: {COMMS_RANGE: 500}         # for every template
    shoreside:
      moos: meta_shoreside.moos
    vehicles:
      count: 4                         # or a list under `each`, or both
      moos: meta_vehicle.moos
      bhv: meta_vehicle.bhv
      start: {area: {x: [0, 100], y: [-100, 0]}, separation: 20}
      macros: {LOITER_X: [0, 60, 0, 60]}   # a list gives each vehicle its own
      each:
        - {name: abe, color: yellow, start: {x: 0, y: -20, heading: 180}}
    presets:                           # variants, chosen with --preset NAME
      crowd: {vehicles: {count: 8}}

Nothing is run here and no template is opened: this is the file, checked and completed.
"""

from __future__ import annotations

import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pymoos_lite.config.fleet_starts import read_starts
from pymoos_lite.config.presets import apply_presets
from pymoos_lite.config.problems import Problem
from pymoos_lite.config.start_poses import Pose
from pymoos_lite.config.strict_yaml import Listing, Reader, Scalar, Table, Tree, read_yaml

_NAME_LIST = "abe ben cal deb eve fin max ned oak pal que ray sam tom uma val wes xan yen zoe"
NAMES = tuple(_NAME_LIST.split())
_COLOR_LIST = (
    "yellow red dodger_blue green purple orange white dark_green cyan pink brown gold "
    "magenta light_blue salmon violet tan turquoise khaki orchid"
)
COLORS = tuple(_COLOR_LIST.split())
MAX_VEHICLES = 1000
DEFAULT_COMMANDS: dict[str, dict[str, str | float]] = {
    "deploy": {
        "DEPLOY": "true",
        "MOOS_MANUAL_OVERRIDE": "false",
        "RETURN": "false",
        "STATION_KEEP": "false",
        "AVOID": "true",
    },
    "return": {"RETURN": "true", "STATION_KEEP": "false"},
    "station": {"STATION_KEEP": "true"},
    "pause": {"MOOS_MANUAL_OVERRIDE": "true"},
}
"""What a command posts for each vehicle, at the shoreside as VAR_ALL or VAR_<NAME>."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,62}\Z")
_MACRO = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


@dataclass(frozen=True, slots=True)
class CommunityEntry:
    """One community: its name, its templates (relative to the file) and the macros they are expanded with."""

    name: str
    moos: str
    bhv: str
    macros: dict[str, str]
    line: int


@dataclass(frozen=True, slots=True)
class VehicleEntry(CommunityEntry):
    """A vehicle also has a colour and a place to start."""

    color: str
    start: Pose


@dataclass(frozen=True, slots=True)
class NetworkEntry:
    """How datagrams fare between communities in lockstep; None: the host's default."""

    latency: float | None = None
    jitter: float | None = None
    loss: float | None = None
    duplication: float | None = None
    bandwidth: float | None = None
    queue: float | None = None


@dataclass(frozen=True, slots=True)
class FleetFile:
    """A checked fleet file. `database_port` and `share_port` are None when any free ports will do.

    `duration` is how many mission seconds a run in lockstep takes when nobody says otherwise.
    """

    file: str
    name: str
    warp: float
    seed: int
    shoreside: CommunityEntry | None
    vehicles: tuple[VehicleEntry, ...]
    datum: tuple[float, float] | None
    network: NetworkEntry
    database_port: int | None
    share_port: int | None
    deploy_after: float | None
    duration: float | None
    commands: dict[str, dict[str, str | float]]
    problems: tuple[Problem, ...]

    @property
    def errors(self) -> list[Problem]:
        return [p for p in self.problems if p.severity == "error"]

    def vehicle_names(self) -> list[str]:
        return [vehicle.name for vehicle in self.vehicles]


def parse_fleet(
    text: str,
    file: str,
    vehicles: int | None = None,
    seed: int | None = None,
    presets: Sequence[str] = (),
    macros: Mapping[str, str] | None = None,
) -> FleetFile:
    """Read a fleet file; never raises, all problems are in the result.

    `vehicles` replaces the number of vehicles, `seed` the file's seed. `presets` are laid over the file in
    that order; `macros` are added to every template's, and replace those of the same name.
    """
    problems: list[Problem] = []
    tree = apply_presets(read_yaml(text, file, problems), presets, file, problems)
    top = Reader(tree, file, "a fleet file", problems)
    own_seed = top.integer("seed", 0)
    chosen = own_seed if seed is None else seed
    shared = _macros(top, "macros", 1)
    ports = top.table("ports")
    fleet = FleetFile(
        file=file,
        name=top.text("fleet", "fleet"),
        warp=_warp(top),
        seed=chosen,
        shoreside=_shoreside(top, shared),
        vehicles=_vehicles(top, shared, vehicles, random.Random(f"{chosen}:fleet")),
        datum=_datum(top),
        network=_network(top),
        database_port=_port(ports, "database"),
        share_port=_port(ports, "share"),
        deploy_after=top.number("deploy_after", 0.0, low=0.0) if top.get("deploy_after") else None,
        duration=top.number("duration", 0.0, low=0.0) or None,
        commands=_commands(top),
        problems=(),
    )
    ports.done()
    top.done()
    if not problems:
        _check_names(fleet, problems)
    if macros:
        fleet = _with_macros(fleet, macros)
    return replace(fleet, problems=tuple(sorted(set(problems), key=lambda p: (p.line, p.text))))


def _with_macros(fleet: FleetFile, macros: Mapping[str, str]) -> FleetFile:
    shore = fleet.shoreside
    if shore is not None:
        shore = replace(shore, macros={**shore.macros, **macros})
    vehicles = tuple(replace(v, macros={**v.macros, **macros}) for v in fleet.vehicles)
    return replace(fleet, shoreside=shore, vehicles=vehicles)


def _warp(top: Reader) -> float:
    warp = top.number("warp", 1.0, low=0.0, high=400.0)
    if warp == 0.0:
        top.problem(top.line_of("warp"), "warp: must be above 0")
        return 1.0
    return warp


def _port(ports: Reader, key: str) -> int | None:
    return ports.integer(key, 0, low=1, high=65000) or None


def _datum(top: Reader) -> tuple[float, float] | None:
    if "datum" not in top:
        return None
    table = top.table("datum")
    place = table.number("lat", 0.0, -80.0, 84.0), table.number("lon", 0.0, -180.0, 180.0)
    for key in ("lat", "lon"):
        if key not in table:
            table.problem(table.line, f"datum: {key} is missing")
    table.done()
    return place


def _network(top: Reader) -> NetworkEntry:
    table = top.table("network")
    values: dict[str, float] = {}
    for key in ("latency", "jitter", "loss", "duplication", "bandwidth", "queue"):
        high = 1.0 if key in ("loss", "duplication") else None
        if table.get(key) is not None:
            values[key] = table.number(key, 0.0, low=0.0, high=high)
    table.done()
    return NetworkEntry(**values)


def _commands(top: Reader) -> dict[str, dict[str, str | float]]:
    commands = {name: dict(posts) for name, posts in DEFAULT_COMMANDS.items()}
    table = top.table("commands")
    for name, tree in table.entries():
        posts: dict[str, str | float] = {}
        for variable, value in Reader(tree, table.file, name, table.problems).entries():
            if not isinstance(value, Scalar):
                table.problem(value.line, f"{name}: {variable} needs one value")
                continue
            if value.plain and value.tag == "bool" and value.text.lower() not in ("true", "false"):
                table.problem(value.line, f"{variable}: write true or false, or put '{value.text}' in quotes")
                continue
            number = value.plain and value.tag in ("int", "float")
            posts[variable] = table.as_number(value, variable, 0.0) if number else _plain_text(value)
        commands[name] = posts
    return commands


def _plain_text(value: Scalar) -> str:
    return value.text.lower() if value.plain and value.tag == "bool" else value.text


def _macros(table: Reader, key: str, count: int) -> dict[str, list[str]]:
    """Macro values; a list has one for each of `count` vehicles."""
    found: dict[str, list[str]] = {}
    inner = table.table(key)
    for name, tree in inner.entries():
        if not _MACRO.match(name):
            inner.problem(inner.line_of(name), f"macro '{name}': a name has letters, digits and _ only")
            continue
        trees = tree.items if isinstance(tree, Listing) else (tree,)
        values = [_macro_value(inner, name, item) for item in trees]
        if isinstance(tree, Listing) and len(values) < count:
            inner.problem(tree.line, f"macro {name}: {len(values)} values for {count} vehicles")
            values += [""] * (count - len(values))
        found[name] = values
    return found


def _macro_value(table: Reader, name: str, tree: Tree) -> str:
    if not isinstance(tree, Scalar):
        table.problem(tree.line, f"macro {name}: expected one value")
        return ""
    if tree.plain and tree.tag == "bool":
        # A macro is text: true and false stand for themselves, `on` and `no` would be guesses.
        if tree.text.lower() not in ("true", "false"):
            table.problem(tree.line, f"macro {name}: put '{tree.text}' in quotes, or write true or false")
        return tree.text
    if tree.plain and tree.tag == "null":
        return ""
    return tree.text


def _of(macros: dict[str, list[str]], index: int) -> dict[str, str]:
    return {name: values[index] if len(values) > 1 else values[0] for name, values in macros.items()}


def _shoreside(top: Reader, shared: dict[str, list[str]]) -> CommunityEntry | None:
    if "shoreside" not in top:
        return None
    table = top.table("shoreside")
    entry = CommunityEntry(
        name=_name(table, table.text("name", "shoreside"), table.line),
        moos=_template(table, "moos", required=True),
        bhv="",
        macros={**_of(shared, 0), **_of(_macros(table, "macros", 1), 0)},
        line=table.line,
    )
    table.done()
    return entry


def _template(table: Reader, key: str, required: bool = False, default: str = "") -> str:
    name = table.text(key, default)
    if required and not name:
        table.problem(table.line, f"{table.where}: {key} is missing: name a template file")
    return name


def _name(table: Reader, name: str, line: int) -> str:
    if not _NAME.match(name):
        table.problem(line, f"'{name}' is no name for a community: letters, digits, '_', '.', '-', up to 63")
        return "unnamed"
    return name


def _vehicles(
    top: Reader, shared: dict[str, list[str]], wanted: int | None, dice: random.Random
) -> tuple[VehicleEntry, ...]:
    tree = top.get("vehicles")
    if isinstance(tree, Listing):  # just a list of vehicles
        tree = Table({"each": tree}, {"each": tree.line}, tree.line)
    table = Reader(tree, top.file, "vehicles", top.problems)
    each = table.get("each")
    entries = each.items if isinstance(each, Listing) else ()
    if each is not None and not isinstance(each, Listing):
        table.problem(each.line, "each: expected a list of vehicles, one '- name: ...' each")
    count = table.integer("count", len(entries), low=0, high=MAX_VEHICLES)
    if "count" in table and count < len(entries):
        table.problem(table.line_of("count"), f"count: {count}, but {len(entries)} vehicles are listed")
        count = len(entries)
    if wanted is not None:
        count = min(max(wanted, 0), MAX_VEHICLES)
        entries = entries[:count]
    if count == 0 and wanted is None:
        table.problem(table.line, "vehicles: there is none: give a count or a list under 'each'")
    macros = _macros(table, "macros", count)
    names = table.texts("names")
    colors = table.texts("colors") or list(COLORS)
    moos, bhv = table.text("moos"), table.text("bhv")
    readers = [Reader(item, top.file, "a vehicle", top.problems) for item in entries]
    readers += [Reader(None, top.file, "a vehicle", top.problems)] * (count - len(readers))
    chosen = _chosen_names(readers, names)
    starts = read_starts(table, readers, dice)
    found = []
    for i, (reader, name) in enumerate(zip(readers, chosen, strict=True)):
        line = reader.line or table.line
        own = _of(_macros(reader, "macros", 1), 0)
        template = reader.text("moos", moos)
        if not template:
            table.problem(line, f"vehicle {name}: moos is missing: name a template file")
        found.append(
            VehicleEntry(
                name=_name(reader, name, line),
                moos=template,
                bhv=reader.text("bhv", bhv),
                macros={**_of(shared, 0), **_of(macros, i), **own},
                line=line,
                color=reader.text("color", colors[i % len(colors)]),
                start=starts[i],
            )
        )
        reader.done()
    table.done()
    return tuple(found)


def _chosen_names(readers: list[Reader], names: list[str]) -> list[str]:
    given = [reader.text("name") for reader in readers]
    spare = [n for n in (*names, *NAMES) if n not in given]
    spare = list(dict.fromkeys(spare))
    chosen = []
    for i, name in enumerate(given):
        chosen.append(name or (spare.pop(0) if spare else f"v{i + 1:02d}"))
    return chosen


def _check_names(fleet: FleetFile, problems: list[Problem]) -> None:
    """No two communities may share a name; case does not tell them apart on the shoreside."""
    seen: dict[str, CommunityEntry] = {}
    entries: list[CommunityEntry] = [fleet.shoreside] if fleet.shoreside is not None else []
    for entry in (*entries, *fleet.vehicles):
        former = seen.setdefault(entry.name.upper(), entry)
        if former is not entry:
            text = f"two communities are named '{entry.name}' (the other at line {former.line})"
            problems.append(Problem(fleet.file, entry.line, text))
