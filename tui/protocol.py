"""Interface between console and transport: events of a link, and the link itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.team_messages import TeamCells
from touchline.schemas.messages.touchline import PaintMarks
from touchline.schemas.topics import Service


class CallFailed(TouchlineError):
    """A command that got no usable answer; the text says why."""


@dataclass(frozen=True)
class Received:
    """A decoded message of a topic; `publisher` tells one run of a process from the next."""

    topic: str
    message: Message
    publisher: str = ""


@dataclass(frozen=True)
class Skimmed:
    """A message of a topic came whose content is of no interest now."""

    topic: str
    publisher: str


@dataclass(frozen=True)
class NodeChanged:
    """A process appeared on the bus or vanished from it."""

    node: str
    alive: bool


@dataclass(frozen=True)
class Rejected:
    """A payload that could not be read; nothing of it was used."""

    topic: str
    reason: str


@dataclass(frozen=True)
class PaintFetched:
    """Everything painted in the session, as the robot tells it; None when it did not answer."""

    strokes: tuple[PaintMarks, ...] | None


@dataclass(frozen=True)
class Lost:
    """Messages lost on the way to this console since it started."""

    messages: int


Incoming = Received | Skimmed | NodeChanged | Rejected | PaintFetched | Lost


class Link(Protocol):
    """The console's way to one robot. Only `call` blocks; it and `tell` may be called from any thread."""

    def poll(self) -> list[Incoming]:
        """Everything that came in since the last poll, state topics thinned to their latest message.

        Of the traversal's status each change of its state comes in, too.
        """
        ...

    def call(self, service: Service[Any, Any], request: Message, timeout_s: float) -> Message:
        """Ask a service and wait for its answer. Raises CallFailed when there is none."""
        ...

    def tell(self, service: Service[Any, Any], request: Message) -> None:
        """Send a request at once, from this thread, without waiting for an answer or hearing of it. Never raises."""
        ...

    def attend(self, *, closely: bool) -> None:
        """Listen to all that the robot says, or (as at first) only to what is shown of one among others."""
        ...

    def fetch_paint(self) -> None:
        """Ask for everything painted so far; a PaintFetched follows. Does nothing while one is under way."""
        ...


class Links(Protocol):
    """The console's ways to the robots that there are."""

    def found(self) -> list[tuple[str, Link]]:
        """Robots that have been found since the last call, by namespace; the first call has at least one. Never waits.

        One that has gone is no news: its link goes on, and says so.
        """
        ...

    def team(self) -> TeamCells | None:
        """What a team's coordinator has told since the last call, if there is one. Never waits."""
        ...
