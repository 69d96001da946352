"""From a fleet file to the communities it stands for: templates expanded, ports chosen, plans made.

The expanded files are written to a folder, where a person can read them and where problems point to;
missions written for nsplug and a launch script work as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pymoos_lite.config.fleet_file import CommunityEntry, FleetFile, VehicleEntry, parse_fleet
from pymoos_lite.config.macros import expand
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.overrides import override
from pymoos_lite.config.problems import Problem, did_you_mean
from pymoos_lite.geometry.text import num
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.mission import MissionError, parse_mission_file, shipped_missions, shown_path
from pymoos_lite.hosts.network import Conditions
from pymoos_lite.hosts.plan import CommunityPlan, plan_community

FLEET_FILE = "fleet.yaml"
FIRST_DATABASE_PORT = 9000
FIRST_SHARE_PORT = 9200
PORTS_APART = 200
DEPLOY_AFTER = 10.0
"""Mission seconds after which a fleet is deployed in lockstep, where no person could do it."""


@dataclass(frozen=True)
class Member:
    """One community of a fleet, ready to be started. `vehicle` is None for the shoreside."""

    name: str
    plan: CommunityPlan
    files: Mapping[str, Path]
    vehicle: VehicleEntry | None = None


@dataclass(frozen=True)
class FleetPlan:
    """A whole fleet, ready to be started, and all that is wrong with it."""

    fleet: FleetFile
    members: tuple[Member, ...]
    problems: tuple[Problem, ...]

    @property
    def shoreside(self) -> Member | None:
        return next((m for m in self.members if m.vehicle is None), None)

    @property
    def errors(self) -> list[Problem]:
        return [p for p in self.problems if p.severity == "error"]

    def posts(self, command: str, vehicles: Iterable[str] = ()) -> list[tuple[str, str | float]]:
        """What to post at the shoreside for a command to all vehicles, or to some.

        Raises:
            MissionError: unknown command or vehicle.
        """
        fleet = self.fleet
        return posts_for(fleet.commands, command, list(vehicles), fleet.vehicle_names())


def posts_for(
    commands: Mapping[str, Mapping[str, str | float]], command: str, vehicles: list[str], known: list[str]
) -> list[tuple[str, str | float]]:
    """What to post at the shoreside for a command; `known` are the fleet's vehicles, empty for any.

    Raises:
        MissionError: unknown command or vehicle.
    """
    if command not in commands:
        hint = did_you_mean(command, commands) or f"; known are {', '.join(commands)}"
        raise MissionError(f"there is no command '{command}'{hint}")
    for name in vehicles:
        if known and name.lower() not in (n.lower() for n in known):
            raise MissionError(f"there is no vehicle '{name}'{did_you_mean(name, known)}")
    ends = [name.upper() for name in vehicles] or ["ALL"]
    return [(f"{variable}_{end}", value) for end in ends for variable, value in commands[command].items()]


def is_fleet(name: str) -> bool:
    """Whether `name` means a fleet: a .yaml file, or a folder or shipped mission that has a fleet.yaml."""
    return _fleet_path(name) is not None


def _fleet_path(name: str) -> Path | None:
    path = Path(name).expanduser()
    if path.suffix.lower() in (".yaml", ".yml"):
        return path
    if path.is_file():
        return None
    folder = path if path.is_dir() else shipped_missions().get(name)
    if folder is not None and (folder / FLEET_FILE).is_file():
        return folder / FLEET_FILE
    return None


def find_fleet(name: str) -> Path:
    """The fleet file meant by `name`.

    Raises:
        MissionError: there is none.
    """
    path = _fleet_path(name)
    if path is None or not path.is_file():
        raise MissionError(
            f"{name}: no such fleet file, and no folder or shipped mission with a {FLEET_FILE}"
        )
    return path


def load_fleet(
    path: Path,
    vehicles: int | None = None,
    seed: int | None = None,
    presets: Sequence[str] = (),
    macros: Mapping[str, str] | None = None,
) -> FleetFile:
    """Read a fleet file; its problems are in it. Arguments as in `parse_fleet`.

    Raises:
        MissionError: it cannot be opened.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise MissionError(f"{path}: {error.strerror or error}") from None
    return parse_fleet(text, shown_path(path), vehicles, seed, presets, macros)


def plan_fleet(
    fleet: FleetFile,
    folder: Path,
    out: Path,
    *,
    warp: float | None = None,
    ports: Mapping[str, tuple[int, int]] | None = None,
    settings: Mapping[str, str] | None = None,
) -> FleetPlan:
    """Expand every template of `folder` into `out` and plan every community.

    `ports` are (database, share) by community, by default the customary ones; `settings` go into every
    mission as ``--set`` does. Nothing is raised for a faulty mission: see `problems`.

    Raises:
        MissionError: `out` cannot be written, or a setting matches nothing anywhere.
    """
    problems = list(fleet.problems)
    if fleet.errors:
        return FleetPlan(fleet, (), tuple(problems))
    chosen = ports or customary_ports(fleet)
    shared = _shared_macros(fleet, warp or fleet.warp, chosen)
    entries: list[CommunityEntry] = [fleet.shoreside] if fleet.shoreside is not None else []
    writer = _Writer(fleet, folder, out.resolve(), problems)
    members = []
    unmatched = set(settings or {})
    for entry in (*entries, *fleet.vehicles):
        macros = {**shared, **_own_macros(fleet, entry, chosen), **entry.macros}
        files = writer.expand(entry, macros)
        if files is None:
            continue
        member, missed = _member(entry, files, folder, settings or {})
        unmatched &= set(missed)
        members.append(member)
        problems += member.plan.problems
        if member.plan.community != entry.name:
            text = f"Community is '{member.plan.community}', but the fleet file calls it '{entry.name}'"
            problems.append(Problem(member.plan.mission.file, 0, text + " (write Community = $(VNAME))"))
    if unmatched and members:
        raise MissionError(f"--set {min(unmatched)}: no mission of the fleet has a line of that name")
    return FleetPlan(fleet, tuple(members), tuple(dict.fromkeys(problems)))


def _member(
    entry: CommunityEntry, files: Mapping[str, Path], folder: Path, settings: Mapping[str, str]
) -> tuple[Member, tuple[str, ...]]:
    plan, missed = plan_member(files, folder, settings)
    return Member(entry.name, plan, files, entry if isinstance(entry, VehicleEntry) else None), missed


def plan_member(
    files: Mapping[str, Path], folder: Path, settings: Mapping[str, str]
) -> tuple[CommunityPlan, tuple[str, ...]]:
    """The plan of one community from its expanded files, and the settings that matched nothing in it.

    Raises:
        MissionError: the mission file cannot be opened.
    """
    mission, missed = override(parse_mission_file(files["moos"]), settings)
    plan = plan_community(mission, folder)
    written = {path.name: path for path in files.values()}
    return replace(
        plan, apps=tuple(replace(app, lines=_pointed(app.lines, written)) for app in plan.apps)
    ), missed


def _pointed(lines: tuple[ConfigLine, ...], written: Mapping[str, Path]) -> tuple[ConfigLine, ...]:
    """Lines whose value is the name of a file written by us, pointed to where that is."""
    return tuple(
        replace(line, value=str(written[line.value.strip()])) if line.value.strip() in written else line
        for line in lines
    )


def customary_ports(fleet: FleetFile) -> dict[str, tuple[int, int]]:
    """Database and share port of every community: 9000 and 9200 for the shoreside, one more for each vehicle.

    A fleet too large for the gap between the two gets a wider one.
    """
    database = fleet.database_port or FIRST_DATABASE_PORT
    share = fleet.share_port or database + max(PORTS_APART, len(fleet.vehicles) + 1)
    names = [fleet.shoreside.name if fleet.shoreside is not None else "", *fleet.vehicle_names()]
    return {name: (database + i, share + i) for i, name in enumerate(names)}


def _shared_macros(fleet: FleetFile, warp: float, ports: Mapping[str, tuple[int, int]]) -> dict[str, str]:
    """Macros that every template may use."""
    macros = {
        "MISSION": fleet.name,
        "WARP": num(warp, 6),
        "SEED": str(fleet.seed),
        "AMT": str(len(fleet.vehicles)),
        "VNAMES": ":".join(fleet.vehicle_names()),
        "IP_ADDR": "localhost",
        "XMODE": "SIM",
    }
    if fleet.datum is not None:
        macros["LAT_ORIGIN"], macros["LONG_ORIGIN"] = (num(value, 9) for value in fleet.datum)
    if fleet.shoreside is not None:
        database, share = ports[fleet.shoreside.name]
        macros |= {
            "SHORE_NAME": fleet.shoreside.name,
            "SHORE_IP": "localhost",
            "SHORE_PORT": str(database),
            "SHORE_PSHARE": str(share),
        }
    return macros


def _own_macros(
    fleet: FleetFile, entry: CommunityEntry, ports: Mapping[str, tuple[int, int]]
) -> dict[str, str]:
    """Macros of one community."""
    database, share = ports[entry.name]
    macros = {"VNAME": entry.name, "MOOS_PORT": str(database), "PSHARE_PORT": str(share)}
    if isinstance(entry, VehicleEntry):
        start = entry.start
        macros |= {
            "COLOR": entry.color,
            "INDEX": str(fleet.vehicles.index(entry) + 1),
            "START_POS": start.to_text(),
            "START_X": num(start.x),
            "START_Y": num(start.y),
            "START_HEADING": num(start.heading),
            "START_SPEED": num(start.speed),
            "BHV_FILE": f"targ_{entry.name}.bhv",
        }
    return macros


@dataclass(frozen=True)
class _Writer:
    """Expands templates and writes what comes out."""

    fleet: FleetFile
    folder: Path
    out: Path
    problems: list[Problem]

    def expand(self, entry: CommunityEntry, macros: Mapping[str, str]) -> dict[str, Path] | None:
        """The files written for one community, by kind; None if one of them could not be made."""
        written: dict[str, Path] = {}
        for kind, template in (("moos", entry.moos), ("bhv", entry.bhv)):
            if not template:
                continue
            path = self._one(entry, template, f"targ_{entry.name}.{kind}", macros)
            if path is None:
                return None
            written[kind] = path
        return written

    def _one(self, entry: CommunityEntry, template: str, name: str, macros: Mapping[str, str]) -> Path | None:
        found = self._read(template)
        if found is None:
            text = f"{entry.name}: there is no template '{template}' beside the fleet file"
            self.problems.append(Problem(self.fleet.file, entry.line, text))
            return None
        expansion = expand(found[1], found[0], dict(macros), self._read)
        self.problems.extend(expansion.problems)
        if expansion.errors:
            return None
        path = self.out / name
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            path.write_text(expansion.text, encoding="utf-8")
        except OSError as error:
            raise MissionError(f"{path}: {error.strerror or error}") from None
        return path

    def _read(self, name: str) -> tuple[str, str] | None:
        path = self.folder / name
        try:
            return shown_path(path), path.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return None


def add_fleet(host: Lockstep, plan: FleetPlan) -> None:
    """Add every community of a fleet to a lockstep host, with the network the file asks for.

    Raises:
        ValueError: conditions of the network that make no sense.
    """
    given = plan.fleet.network
    values = {name: v for name in given.__slots__ if (v := getattr(given, name)) is not None}
    if values:
        host.network.set_conditions(Conditions(**values))
    for member in plan.members:
        host.add_plan(member.plan)


def deploy_in_lockstep(host: Lockstep, plan: FleetPlan) -> None:
    """Deploy the fleet when the file says, or a little after the start: nobody else could."""
    after = plan.fleet.deploy_after
    shore = plan.shoreside
    if shore is None:
        return
    for name, value in plan.posts("deploy"):
        host.poke(DEPLOY_AFTER if after is None else after, name, value, shore.name)
