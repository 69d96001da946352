"""pShare: sends variables of this community to others, and posts what others send (native_wire.md 3).

What goes where is decided in `routes`, how it travels in `letterbox`. Sharing is unreliable, as UDP
is; every datagram or message that was thrown away is counted by its reason in the report.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from typing import Final

from mypy_extensions import mypyc_attr

from pymoos_lite.app import Address, App, AppContext, DatagramPort, Datagrams
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.core.subscriptions import is_pattern, matches
from pymoos_lite.field.datagrams import DATAGRAM_BYTES, MAX_NUMBER, as_key, message_size
from pymoos_lite.field.letterbox import Inbox, Outbox
from pymoos_lite.field.routes import (
    DEFAULT_BASE_PORT,
    DEFAULT_GROUP,
    Channels,
    Endpoint,
    Listening,
    Output,
    OutputTable,
    RouteError,
    Share,
    parse_command,
    parse_input,
    parse_input_fields,
    parse_output,
    parse_output_fields,
)
from pymoos_lite.field.share_report import Destination, Drops, Input, share_report
from pymoos_lite.records.csp import clip, parse_number

SUMMARY_PERIOD = 1.0
REOPEN_PERIOD = 5.0
MAX_HEARD = 256
_new_tuple: Final = tuple.__new__  # what Message(...) does, in a third of the time
_VITAL = ("NODE_BROKER_PING", "NODE_BROKER_ACK")


def _checked_output(text: str) -> str:
    # Read again with the block's own multicast settings; here it is for `file:line` alone.
    parse_output(text, Channels())
    return text


def _checked_input(text: str) -> str:
    parse_input(text, Channels())
    return text


def parse_outage(text: str) -> tuple[float, float]:
    """``4200:5700``: mission seconds since the start.

    Raises:
        ValueError: another form, or an end before its beginning.
    """
    begin, colon, end = text.partition(":")
    times = parse_number(begin.strip()), parse_number(end.strip())
    if not colon or times[0] is None or times[1] is None or not 0.0 <= times[0] < times[1]:
        raise ValueError("expected BEGIN:END in mission seconds since the start")
    return times[0], times[1]


@mypyc_attr(allow_interpreted_subclasses=True)
class ShareApp(App):
    """Bridges this community to others; see `PARAMETERS`."""

    DEFAULT_TICK = 4.0
    MAIL_DRIVEN = True
    PARAMETERS = Declaration(
        (
            Parameter(
                "output",
                "custom",
                doc="What to send where: src_name=VAR[,dest_name=VAR],route=HOST:PORT[&..][,frequency=HZ]"
                "[,duration=S][,max_shares=N], or VAR->[NAME:]HOST:PORT[@HZ].",
                parse=_checked_output,
                repeated=True,
                example="src_name=NODE_REPORT_LOCAL, dest_name=NODE_REPORT, route=localhost:9200",
            ),
            Parameter(
                "input",
                "custom",
                doc="Where to listen: route=HOST:PORT or multicast_N [&..][,white_list=NAME&NAME].",
                parse=_checked_input,
                repeated=True,
                example="route=localhost:9201",
            ),
            Parameter(
                "multicast_base_port",
                "integer",
                DEFAULT_BASE_PORT,
                "",
                "multicast_N is at this port plus N.",
                low=1,
                high=65279,
            ),
            Parameter("multicast_address", "text", DEFAULT_GROUP, "", "Group of the multicast channels."),
            Parameter("verbose", "boolean", False, "", "Accepted; the report shows what happens."),
            Parameter(
                "datagram_bytes",
                "integer",
                DATAGRAM_BYTES,
                "bytes",
                "Largest datagram to send; longer messages travel in several.",
                low=256,
                high=60000,
            ),
            Parameter(
                "max_message_bytes",
                "integer",
                1 << 20,
                "bytes",
                "Longest message to send or take in.",
                low=1024,
                high=1 << 23,
            ),
            Parameter(
                "share_key",
                "text",
                "",
                "",
                "Phrase that all communities share: datagrams are sealed with it, others refused. "
                "Clocks must agree to within a minute.",
            ),
            Parameter(
                "outage",
                "custom",
                doc="Simulates a broken radio: from BEGIN to END, in mission seconds since the start, nothing is sent "
                "and nothing taken in.",
                parse=parse_outage,
                repeated=True,
                example="4200:5700",
            ),
            Parameter(
                "allow_from",
                "text",
                "",
                "",
                "Numeric addresses to take datagrams from, with wildcards, separated by &; empty: any.",
                example="192.168.1.* & 127.0.0.1",
            ),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.table = OutputTable()
        self.inputs: list[Input] = []
        self.drops = Drops()
        self.destinations: dict[Endpoint, Destination] = {}
        self._latest: dict[str, Message] = {}
        self._registered: dict[tuple[str, str], None] = {}
        self._heard: OrderedDict[tuple[Address, str], None] = OrderedDict()
        self._sender: DatagramPort | None = None
        self._out: DatagramPort | None = None
        self._posted: dict[str, str] = {}
        self._stale_summaries = True
        self._last_summary = float("-inf")
        self._next_reopen = float("inf")

    # --- life --------------------------------------------------------------------------------

    def on_start_up(self) -> None:
        config = self.config
        self._channels = Channels(config.multicast_address, config.multicast_base_port)
        self._key = as_key(config.share_key)
        network = self.context.network
        self._by_reference = network is not None and network.by_reference and self._key is None
        self._budget: int = config.datagram_bytes
        self._longest: int = config.max_message_bytes
        self.inbox = Inbox(self._key, config.max_message_bytes, freshness=60.0 * self.clock.warp)
        self._allowed = tuple(p for p in "".join(config.allow_from.split()).split("&") if p)
        self._command = f"{self.name.upper()}_CMD"
        if network is None:
            self.config_warning("this host has no network: nothing is shared")
        for text in config.input:
            try:
                self._listen(parse_input(text, self._channels))
            except RouteError as error:
                self.config_warning(f"input = {clip(text)}: {error}")
        for text in config.output:
            try:
                for share in parse_output(text, self._channels):
                    self._add(share, register=False)
            except RouteError as error:
                self.config_warning(f"output = {clip(text)}: {error}")

    def on_connect(self) -> None:
        self.register(self._command)
        self._registered.clear()
        for share in (*self.table.plain_shares(), *self.table.wild_shares()):
            self._register(share)
        self._posted.clear()
        self._stale_summaries = True

    def iterate(self) -> None:
        if self.now >= self._next_reopen:
            self._reopen()
        self.inbox.expire(self.clock.wall())
        if self._stale_summaries and self.now - self._last_summary >= SUMMARY_PERIOD:
            self._post_summaries()

    # --- out ---------------------------------------------------------------------------------

    def on_mail(self, mail: list[Message]) -> None:
        command, latest, table, send, now = self._command, self._latest, self.table, self._send, self.now
        for message in mail:
            name = message[0]
            if name == command:
                self._obey(message)
            else:
                latest[name] = message
                found = table.find(message, now) if table.has_wildcards else table.by_variable.get(name, ())
                for output in found:
                    send(output, message)
        self._flush()

    def _send(self, output: Output, message: Message) -> None:
        now = self.now
        if output.limited and not output.wants(now):
            output.skipped += 1
            return
        destination = self.destinations[output.share.to]
        if output.wild:
            if output.shares == 0:
                self._stale_summaries = True
            # Two communities that share everything with each other must not play ball with it.
            community = message.community
            if community != self.community and (destination.address, community) in self._heard:
                self.drops.echoed += 1
                return
        if output.name != message[0]:
            message = _new_tuple(Message, (output.name, *message[1:]))
        size = message_size(message)
        if size > self._longest:
            self.drops.oversized += 1
            self.run_warning(f"{message.name} of {size} bytes is longer than max_message_bytes: not shared")
            return
        output.sent(now, size)
        full = destination.outbox.add(message, size, now)
        if full:
            for payload in full:
                self._dispatch(destination, payload)

    def _flush(self) -> None:
        for destination in self.destinations.values():
            if destination.outbox.messages:
                for payload in destination.outbox.flush(self.now):
                    self._dispatch(destination, payload)

    def _dispatch(self, destination: Destination, payload: object) -> None:
        if self.config.outage and self._silent():
            self.drops.silenced += 1
            return
        port = self._out or self._sending_port()
        destination.datagrams += 1
        destination.bytes += getattr(payload, "size", 0) or len(payload)  # type: ignore[arg-type]
        if port is None or not port.send(payload, destination.address):  # type: ignore[arg-type]
            destination.failed += 1

    def _silent(self) -> bool:
        """Whether an `outage` is on."""
        return any(begin <= self.now - self.started < end for begin, end in self.config.outage)

    def _sending_port(self) -> DatagramPort | None:
        """Datagrams leave from the first place we listen at, so that receivers know whom they hear."""
        listening = (e.port for e in self.inputs if e.port is not None and e.at.channel < 0)
        self._out = next(listening, None)
        if self._out is None and self._sender is None:
            try:
                self._sender = self.open_port()
            except OSError as error:
                self.run_warning(f"cannot open a port to send from: {error.strerror or error}")
        return self._out or self._sender

    # --- in ----------------------------------------------------------------------------------

    def on_datagrams(self, port: DatagramPort, datagrams: Datagrams) -> None:
        if self.config.outage and self._silent():
            self.drops.silenced += len(datagrams)
            return
        entry = next((i for i in self.inputs if i.port is port), None)
        wall = self.clock.wall()
        for payload, sender in datagrams:
            if self._allowed and not any(matches(p, sender[0]) for p in self._allowed):
                self.drops.strangers += 1
                continue
            self._take(self.inbox.take(payload, sender, self.now, wall), sender, entry)

    def _take(self, messages: list[Message], sender: Address, entry: Input | None) -> None:
        """Post what one sender sent, as far as it is welcome."""
        plain, wild, publish = self.table.plain, self.table.has_wildcards, self.connection.publish
        taken = 0
        for message in messages:
            name = message[0]
            if entry is not None and entry.white_list and not entry.lets_in(name):
                entry.filtered += 1
                if name.startswith(_VITAL):
                    self.run_warning(
                        f"the white list of input {entry.at} keeps out {name}: vehicles and shoreside "
                        "cannot find each other"
                    )
            elif name in plain:
                self.drops.looped += 1
                self.run_warning(f"{name} came in and is shared out under the same name: not posted")
            else:
                if wild and message.community:
                    self._hear(sender, message.community)
                taken += 1
                if not publish(message):
                    self.drops.refused += 1
        if entry is not None:
            entry.taken += taken

    def _hear(self, sender: Address, community: str) -> None:
        """Remember that `sender` passes on what `community` says: it is not sent back there."""
        key = (sender, community)
        if key not in self._heard:
            self._heard[key] = None
            if len(self._heard) > MAX_HEARD:
                self._heard.popitem(last=False)

    # --- commands ----------------------------------------------------------------------------

    def _obey(self, message: Message) -> None:
        if message.time < self.started:
            return  # posted to a predecessor; whoever needs the route says so again
        try:
            verb, values = parse_command(message.text)
            if verb == "input":
                self._listen(parse_input_fields(values, self._channels))
                return
            for share in parse_output_fields(values, self._channels):
                if verb == "remove":
                    self._remove(share)
                else:
                    self._add(share)
        except RouteError as error:
            self.drops.commands += 1
            self.run_warning(f"{self._command} from {message.source}: {error}")

    def _add(self, share: Share, register: bool = True) -> None:
        if share.to not in self.destinations:
            self.destinations[share.to] = self._destination(share.to)
        output = self.table.add(share, self.now)
        self._stale_summaries = True
        known = (share.variable, share.app) in self._registered
        if register:
            self._register(share)
        if output is not None and known and share.duration == 0.0 and share.source in self._latest:
            self._send(output, self._latest[share.source])
            self._flush()

    def _remove(self, share: Share) -> None:
        self.table.remove(share)
        self._stale_summaries = True
        shares = (*self.table.plain_shares(), *self.table.wild_shares())
        wanted = {(s.variable, s.app) for s in shares}
        for name, app in [key for key in self._registered if key not in wanted]:
            del self._registered[name, app]
            if not any(key[0] == name for key in self._registered):
                self.unregister(name)
                self._latest.pop(name, None)
        used = {s.to for s in shares}
        for endpoint in [e for e in self.destinations if e not in used]:
            del self.destinations[endpoint]

    def _destination(self, endpoint: Endpoint) -> Destination:
        network = self.context.network
        try:
            host = (
                network.resolve(endpoint.host)
                if network is not None and endpoint.channel < 0
                else endpoint.host
            )
        except OSError as error:
            raise RouteError(f"{endpoint}: {error.strerror or error}") from None
        # A share that starts again must not be taken for its predecessor, even with the same seed.
        stream = (self.random.getrandbits(53) ^ int(self.started * 1e6)) % MAX_NUMBER
        self.inbox.own_streams.add(stream)
        outbox = Outbox(stream, self._budget, self._by_reference, self._key)
        return Destination(endpoint, (host, endpoint.port), outbox)

    def _register(self, share: Share) -> None:
        key = (share.variable, share.app)
        if key not in self._registered:
            self._registered[key] = None
            # What this app posts about itself is left out of wildcards: it is nobody else's matter.
            omit = ("PSHARE_*_SUMMARY", f"{self.name.upper()}_*") if is_pattern(share.variable) else ()
            self.register(share.variable, 0.0, share.app, omit)

    # --- listening ---------------------------------------------------------------------------

    def _listen(self, wish: Listening) -> None:
        for at in wish.at:
            if any(entry.at == at for entry in self.inputs):
                raise RouteError(f"already listening at {at}")
            entry = Input(at, wish.white_list)
            self.inputs.append(entry)
            self._open(entry)
        self._stale_summaries = True

    def _open(self, entry: Input) -> None:
        try:
            entry.port = self.open_port(entry.at.port, entry.at.host if entry.at.channel >= 0 else "")
            self.retract_run_warning(f"cannot listen at {entry.at}: trying again")
        except OSError as error:
            self.run_warning(f"cannot listen at {entry.at}: trying again")
            self.event(f"cannot listen at {entry.at}: {error.strerror or error}")
            self._next_reopen = self.now + REOPEN_PERIOD * self.clock.warp

    def _reopen(self) -> None:
        self._next_reopen = float("inf")
        for entry in self.inputs:
            if entry.port is None:
                self._open(entry)
        self._stale_summaries = True

    def _post_summaries(self) -> None:
        self._stale_summaries = False
        self._last_summary = self.now
        heard_at = sorted(str(entry.at) for entry in self.inputs if entry.port is not None)
        for name, text in (
            ("PSHARE_OUTPUT_SUMMARY", self.table.summary()),
            ("PSHARE_INPUT_SUMMARY", ",".join(heard_at)),
        ):
            if self._posted.get(name) != text:
                self._posted[name] = text
                self.notify(name, text)

    def report(self) -> Iterable[str]:
        return share_report(self)
