"""What the community database does not accept, and in which words it says so."""

from __future__ import annotations

from dataclasses import dataclass

from pymoos_lite.core.message import KIND_NAME


class NameClashError(Exception):
    """A second client asked for a name that is in use; the first is unaffected."""

    def __init__(self, client: str) -> None:
        super().__init__(f'A client of this name ("{client}") already exists')
        self.client = client


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a write was not accepted: the variable has another type, or there are too many variables."""

    name: str
    client: str
    reason: str
    event: str

    def __str__(self) -> str:
        return self.reason


def wrong_type(name: str, expected: type, found: type, client: str) -> Refusal:
    holds, written = KIND_NAME[expected], KIND_NAME[found]
    reason = (
        f"{client} wrote a {written} to {name}, which holds a {holds}: "
        f"the write was refused (first write of {name} fixed its type)"
    )
    return Refusal(name, client, reason, f"refused={name},client={client},holds={holds},written={written}")


def one_too_many(name: str, client: str, limit: int) -> Refusal:
    reason = (
        f"{client} wrote to {name}, but the community has {limit} variables already: the write was refused"
    )
    # The name is left out, so that a flood of names is one event.
    return Refusal("", client, reason, f"refused=new variables,client={client},limit={limit}")
