"""uLoadWatch: asks apps for their iteration gaps and says who falls behind (community.md 16)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import RecordError, field_map, num, parse_number

REQUEST_PERIOD = 15.0
REQUEST_DURATION = 30.0
_ANY = "ANY"
_GAP = "_ITER_GAP"


class Threshold(NamedTuple):
    """The gap (1 is nominal) from which an app (upper case, or ANY) is in breach."""

    app: str
    gap: float


def parse_threshold(text: str) -> Threshold:
    """`app=pHelmIvP, gapthresh=1.5`. Raises ValueError."""
    try:
        found = field_map("thresh", text)
    except RecordError as refusal:
        raise ValueError(refusal.reason) from None
    gap = parse_number(found.get("gapthresh", ""))
    if not found.get("app") or gap is None or gap <= 1.0:
        raise ValueError("expected app=NAME|ANY, gapthresh=X with X above 1")
    name = found["app"]
    return Threshold(_ANY if name.upper() in (_ANY, "ALL") else name, gap)


class LoadWatch(App):
    """Names compare in any case."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "thresh",
                "custom",
                None,
                "",
                "Gap from which an app is in breach: app=NAME|ANY, gapthresh=X.",
                repeated=True,
                parse=parse_threshold,
                example="app=pHelmIvP, gapthresh=1.5",
            ),
            Parameter(
                "near_breach_thresh",
                "number",
                0.9,
                "",
                "Part of the way to a breach that is near.",
                low=0.0,
                high=1.0,
            ),
            Parameter("breach_trigger", "integer", 1, "", "Breaches forgiven for each app.", low=0),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.thresholds = {t.app.upper(): t.gap for t in self.config.thresh}
        self.worst: dict[str, float] = {}
        self.highest: dict[str, float] = {}
        self.breaches: dict[str, int] = {}
        self.near: dict[str, int] = {}
        self._next_request = 0.0

    def on_connect(self) -> None:
        if _ANY in self.thresholds:
            self.register(f"*{_GAP}")
        else:
            for name in self.thresholds:
                self.register(f"{name}{_GAP}")
        for prefix in ("ULW_BREACH", "ULW_NEAR_BREACH"):
            self.notify(prefix, False)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            gap = message.number
            if message.name.endswith(_GAP) and gap is not None:
                app = message.name.removesuffix(_GAP).upper()
                self.worst[app] = max(gap, self.worst.get(app, 0.0))

    def iterate(self) -> None:
        if self.now >= self._next_request and self.thresholds:
            self._next_request = self.now + REQUEST_PERIOD
            for threshold in self.config.thresh:
                app = "any" if threshold.app == _ANY else threshold.app
                self.notify(
                    "LOADCAST_REQ", f"app={app},thresh={num(threshold.gap)},duration={num(REQUEST_DURATION)}"
                )
        worst, self.worst = self.worst, {}
        for app, gap in worst.items():
            self._judge(app, gap)

    def _judge(self, app: str, gap: float) -> None:
        self.highest[app] = max(gap, self.highest.get(app, 0.0))
        limit = self.thresholds.get(app, self.thresholds.get(_ANY))
        if limit is None:
            return
        if gap > limit:
            self.breaches[app] = self.breaches.get(app, 0) + 1
            if self.breaches[app] > self.config.breach_trigger:
                self._tell("ULW_BREACH", self._counted())
                warning = f"app={app}, maxgap={num(self.highest[app])}, node={self.community}"
                self.notify("LOAD_WARNING", warning)
                self.event(warning)
        elif gap > 1.0 + (limit - 1.0) * self.config.near_breach_thresh:
            self.near[app] = self.near.get(app, 0) + 1
            self._tell("ULW_NEAR_BREACH", self.near)

    def _counted(self) -> dict[str, int]:
        """Breaches beyond those forgiven."""
        forgiven = self.config.breach_trigger
        return {app: count - forgiven for app, count in self.breaches.items() if count > forgiven}

    def _tell(self, prefix: str, counts: dict[str, int]) -> None:
        self.notify(prefix, True)
        self.notify(f"{prefix}_COUNT", float(sum(counts.values())))
        self.notify(f"{prefix}_LIST", ",".join(sorted(counts)))

    def report(self) -> Iterable[str]:
        yield f"{'App':<24} {'Max gap':>8} {'Limit':>8} {'Breaches':>9} {'Near':>6}"
        for app, gap in sorted(self.highest.items()):
            limit = self.thresholds.get(app, self.thresholds.get(_ANY, 0.0))
            yield f"{app:<24} {gap:>8.2f} {limit:>8.2f} {self.breaches.get(app, 0):>9} {self.near.get(app, 0):>6}"
