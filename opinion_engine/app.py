"""pOpinionManager: the opinion engine as an app of a vessel's community (gcid.md 6).

Moves values between the community and `OpinionEngine`; every rule of the dynamics, of messages and of lists
is there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from mypy_extensions import mypyc_attr

from opinion_engine.engine import EngineSettings, OpinionEngine, Update
from opinion_engine.messages import ENCODINGS
from opinion_engine.model import Attention, OpinionError
from opinion_engine.option_file import read_options
from pymoos_lite.app import App
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.config.problems import ConfigurationError, Problem
from pymoos_lite.core.message import Message
from pymoos_lite.records.node_message import NodeMessage

_SOURCE = "OpinionManager"  # what envelopes name as the sending app


def _positive(name: str, default: float, unit: str, doc: str, aliases: tuple[str, ...] = ()) -> Parameter:
    return Parameter(name, "number", default, unit, doc, low=0.0, open_low=True, aliases=aliases)


@mypyc_attr(allow_interpreted_subclasses=True)
class OpinionManager(App):
    """Integrates this vessel's opinions with its neighbours' and posts what the dominant option asks for."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "option_file",
                "text",
                None,
                "",
                "Option file, beside the mission file or the working folder; several append their options.",
                repeated=True,
                example="bloom.opt",
            ),
            _positive("SocialTick", 1.0, "Hz", "Opinion updates per mission second."),
            Parameter("group", "text", "leader", "", "Second field of the opinion message."),
            _positive("tau_u", 10.0, "s", "Time constant of attention."),
            _positive("min_attention", 0.5, "", "Attention at rest, u_min; also its value at start."),
            _positive("max_attention", 1.5, "", "Attention when aroused, u_max."),
            _positive("u_th", 0.1, "", "Threshold y_th of attention, in squared opinion units."),
            _positive("satFunOrder", 2.0, "", "Order n of the Hill function of attention."),
            _positive(
                "opinion_thresh", 0.1, "", "An agent whose largest opinion is below this is undecided."
            ),
            _positive(
                "neighbor_msg_stale_thresh", 2.0, "s", "Age at which a neighbour's opinion stops to count."
            ),
            _positive(
                "numerical_int_gain",
                1.0,
                "",
                "Of the reference, where it has no effect; 1 with model = paper.",
            ),
            Parameter("node_message_color", "text", "off", "", "Colour field of the outgoing node message."),
            Parameter("node_message_dest_group", "text", "", "", "Send to this group instead of to all."),
            Parameter(
                "model",
                "choice",
                "paper",
                "",
                "paper: the published equations, integrated accurately. reference: the authors' "
                "implementation, step for step.",
                choices=("paper", "reference"),
            ),
            Parameter(
                "alpha_as_configured",
                "boolean",
                False,
                "",
                "With model = reference: use alpha as written, not 1.",
            ),
            Parameter(
                "max_dt",
                "number",
                None,
                "s",
                "Longest time one update integrates; default 3 / SocialTick.",
                low=0.0,
                open_low=True,
            ),
            Parameter(
                "encoding",
                "choice",
                "text",
                "",
                "How opinions are sent: text (as node messages), or 1, 2 or 4 bytes per option in a binary "
                "OPINION_MESSAGE_LOCAL to be shared as OPINION_MESSAGE.",
                choices=ENCODINGS,
            ),
            Parameter(
                "seed",
                "integer",
                None,
                "",
                "Seed of randomly_perturb_params; default the mission's seed.",
                low=0,
            ),
        )
    )

    @classmethod
    def explain_block(
        cls,
        lines: Sequence[ConfigLine],
        mission_dir: Path,
        blocks: Mapping[str, Sequence[ConfigLine]],
    ) -> str:
        """The table of options and behaviours, where a helm is beside it."""
        from ivp_helm.behavior_file import read_behavior_file
        from opinion_engine.activation import derive

        helm = [line.value for line in blocks.get("phelmivp", ()) if line.key.lower() == "behaviors"]
        files = [line.value for line in lines if line.key.lower() == "option_file"]
        if not helm or not files:
            return ""
        try:
            options = read_options(mission_dir / name for name in files)
            path = mission_dir / helm[0]
            content = read_behavior_file(path.read_text(encoding="utf-8", errors="replace"), str(path))
            return derive(content, options, {}).table()
        except (OSError, ValueError):
            return ""

    def on_start_up(self) -> None:
        config = self.config
        file = self.context.mission_file
        if not config.option_file:
            raise ConfigurationError(Problem(file, 0, f"{self.name} needs an option_file"))
        if config.model == "paper" and config.numerical_int_gain != 1.0:
            text = (
                f"{self.name}: numerical_int_gain has no place in model = paper, whose integration is "
                "accurate at any step; leave it out (in the reference it has no effect either)"
            )
            raise ConfigurationError(Problem(file, 0, text))
        options = read_options(self._find(text) for text in config.option_file)
        for warning in options.warnings:
            self.config_warning(str(warning))
        seed = config.seed if config.seed is not None else self.context.seed
        options = options.perturbed(f"{seed}:{self.community}")
        try:
            attention = Attention(
                config.tau_u, config.min_attention, config.max_attention, config.u_th, config.satfunorder
            )
            settings = EngineSettings(
                group=config.group,
                attention=attention,
                opinion_thresh=config.opinion_thresh,
                stale=config.neighbor_msg_stale_thresh,
                social_tick=config.socialtick,
                model=config.model,
                alpha_as_configured=config.alpha_as_configured,
                max_dt=config.max_dt,
                encoding=config.encoding,
            )
            self.engine = OpinionEngine(self.community, options, settings, self.now)
        except OpinionError as error:
            raise ConfigurationError(Problem(file, 0, f"{self.name}: {error}")) from None
        self._binary = settings.encoding != "text"
        self._envelope = NodeMessage(
            src_node=self.community.lower(),
            var_name="OPINION_MESSAGE",
            dest_node="" if config.node_message_dest_group else "all",
            dest_group=config.node_message_dest_group,
            src_app=_SOURCE,
            color=config.node_message_color,
        )
        self._warned_of_gap = False

    def _find(self, text: str) -> Path:
        """The option file, looked for beside the mission file first, then in the working folder."""
        beside = self.mission_path(text)
        return beside if beside.exists() or not Path(text).exists() else Path(text)

    def on_connect(self) -> None:
        for name in ("OPINION_MESSAGE", "RESET_OPINIONS", "PROPOSAL_MESSAGE", *self.engine.variables):
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        engine = self.engine
        for message in mail:
            name, value = message.name, message.value
            if name == "OPINION_MESSAGE":
                said = str(value) if isinstance(value, float) else value
                engine.receive(said, self.now, message.community, message.time)
            elif name == "RESET_OPINIONS":
                if message.time >= self.started:  # an older one was for whoever ran before
                    engine.reset(self.now)
                    self.event("opinions reset")
            elif name != "PROPOSAL_MESSAGE" and not isinstance(value, bytes):
                try:
                    engine.take(name, value)
                except OpinionError as error:
                    self.run_warning(str(error))

    def iterate(self) -> None:
        engine = self.engine
        update = engine.update(self.now)
        if update is not None:
            self._publish(update)
        for variable, names in engine.list_changes(self.now):
            self.notify(variable, names)
        if engine.counters.capped and not self._warned_of_gap:
            self._warned_of_gap = True
            self.event(
                f"a long gap between updates: only {engine.settings.longest_dt:g} s of it are integrated"
            )

    def _publish(self, update: Update) -> None:
        for variable, value in update.postings:
            self.notify(variable, value)
        if update.payload is not None:
            self.notify("OPINION_MESSAGE_LOCAL", update.payload)
        else:
            self.notify("NODE_MESSAGE_LOCAL", self._enveloped(update.text))
        self.notify("OWN_OPINION_STATE", update.text)
        self.notify("OWN_ATTENTION", update.u)
        self.notify("OPINION_BYTES", float(self.engine.counters.bytes_sent))

    def _enveloped(self, text: str) -> str:
        e = self._envelope
        return NodeMessage(
            e.src_node, e.var_name, text, e.dest_node, e.dest_group, e.src_app, color=e.color
        ).to_text()

    def report(self) -> Iterable[str]:
        engine, settings, counters = self.engine, self.engine.settings, self.engine.counters
        yield f"Vehicle:    {self.community}   group {settings.group}   model {settings.model}"
        sent = f"{engine.bytes_per_second(self.now):.1f} B/s as {settings.encoding}"
        yield f"Attention:  {engine.u:.4f}   y {engine.y:.4g}   updates {counters.updates}   sent {sent}"
        yield f"Row sum:    {sum(engine.z):.2e}"
        yield ""
        yield f"{'Option':<16} {'Opinion':>10} {'Input b':>10} {'Raw':>10}  Active"
        for j, option in enumerate(engine.options.options):
            raw = engine.raw_inputs[j]
            shown = "-" if raw is None else f"{raw:.4g}"
            active = "yes" if engine.active[j] else "no"
            yield f"{option.name:<16} {engine.z[j]:>10.4f} {engine.inputs[j]:>10.4g} {shown:>10}  {active}"
        yield ""
        best = max(engine.z)
        own = engine.options.names[engine.z.index(best)] if best >= settings.opinion_thresh else ""
        for name, members in engine.population(self.now).items():
            everyone = ", ".join([self.community] * (name == own) + list(members))
            yield f"{name or 'undecided':<16} {everyone or '-'}"
        yield ""
        yield f"{'Neighbour':<16} {'Messages':>8} {'Age':>7}  Last"
        for neighbour in engine.neighbours:
            age = self.now - neighbour.time
            yield f"{neighbour.name:<16} {neighbour.count:>8} {age:>6.1f}s  {neighbour.text[:60]}"
        if counters.rejected or counters.outdated or counters.own:
            yield ""
            yield (
                f"Not taken: {counters.rejected} damaged, {counters.outdated} outdated, {counters.own} own"
                + (f"; last: {counters.last_rejection}" if counters.last_rejection else "")
            )
