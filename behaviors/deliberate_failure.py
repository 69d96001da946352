"""BHV_TestFailure: fail on purpose, to see whether the watchdogs notice (behaviors.md C28)."""

from __future__ import annotations

from behaviors import forms
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration, parse_number

Failure = tuple[str, float]


class DeliberateFailure(RuntimeError):
    """Raised by BHV_TestFailure; the helm must survive it."""


def _failure(text: str) -> Failure:
    kind, comma, seconds = (part.strip().lower() for part in text.partition(","))
    if kind == "crash" and not comma:
        return "crash", 0.0
    if kind in ("burn", "hang"):
        value = parse_number(seconds) if comma else 3.0
        if value >= 0.0:
            return kind, value
    raise ValueError("give crash, burn,SECONDS or hang,SECONDS")


class TestFailure(Behavior):
    """On completion raises an error (crash) or keeps the helm waiting (hang, burn) for some real seconds."""

    __test__ = False  # it is no test of ours, whatever its name
    BHV_NAME = "BHV_TestFailure"
    DEFAULT_NAME = "bhv_test_failure"
    VARIABLES = ()
    PARAMETERS = Declaration(
        (
            forms.custom(
                "failure_type", _failure, ("crash", 0.0), "crash, or burn,SECONDS, or hang,SECONDS.", "crash"
            ),
        )
    )

    def on_complete(self) -> None:
        kind, seconds = self.config.failure_type
        if kind == "crash":
            raise DeliberateFailure("BHV_TestFailure was asked to crash")
        # The one behaviour that blocks: it stands for a plug-in that does.
        import time

        time.sleep(seconds)
