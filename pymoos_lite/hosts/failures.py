"""The last words of an app that raised."""

from __future__ import annotations

import traceback
from dataclasses import dataclass


@dataclass(frozen=True)
class Failure:
    """Which app failed, while doing what, and where in the code."""

    community: str
    app: str
    during: str
    text: str
    where: str
    trace: str

    def __str__(self) -> str:
        return f"{self.app} ({self.community}) failed in {self.during}: {self.text} [{self.where}]"


def describe_failure(community: str, app: str, error: BaseException, during: str) -> Failure:
    """A `Failure` for `error`, pointing at the innermost line it came from."""
    frames = traceback.extract_tb(error.__traceback__)
    where = ""
    if frames:
        last = frames[-1]
        parts = last.filename.replace("\\", "/").split("/")
        where = f"{'/'.join(parts[-2:])}:{last.lineno}"
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return Failure(community, app, during, text, where, "".join(traceback.format_exception(error)))
