"""Interface between console and transport: events of a link, and the link itself."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any, Protocol

from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.team_messages import TeamCells
from touchline.schemas.messages.touchline import PaintMarks
from touchline.schemas.topics import Service


class CallFailed(TouchlineError):
    """Raised for a command without a usable answer; the text gives the reason."""


@dataclass(frozen=True)
class Received:
    """Decoded message of a topic; `publisher` identifies the run of a process."""

    topic: str
    message: Message
    publisher: str = ""


@dataclass(frozen=True)
class Skimmed:
    """Event: a message of a topic came whose content is not needed now."""

    topic: str
    publisher: str


@dataclass(frozen=True)
class NodeChanged:
    """Event: a process appeared on the bus or vanished from it."""

    node: str
    alive: bool


@dataclass(frozen=True)
class LinkChanged:
    """Event: the console lost its link to the router, by which it hears of all others, or has it again.

    Attributes:
        linked: Whether it has it.
        why: Reason for the loss, if it is the console's identity.
    """

    linked: bool
    why: str = ""


@dataclass(frozen=True)
class Rejected:
    """Event: a payload could not be read, and was dropped."""

    topic: str
    reason: str


@dataclass(frozen=True)
class PaintFetched:
    """Event: everything painted in the session, as reported by the robot; None if it did not answer."""

    strokes: tuple[PaintMarks, ...] | None


@dataclass(frozen=True)
class Lost:
    """Event: number of messages to this console that were lost since it started."""

    messages: int


Incoming = Received | Skimmed | NodeChanged | LinkChanged | Rejected | PaintFetched | Lost


class Link(Protocol):
    """Link to one robot. Only `call` and `repeat_at_door` block; they and `post` may be called from any thread."""

    def poll(self) -> list[Incoming]:
        """Return everything that came in since the last poll, state topics reduced to their last message.

        The traversal's status comes at each change of its state, too.
        """
        ...

    def call(self, service: Service[Any, Any], request: Message, timeout_s: float) -> Message:
        """Call a service and wait for its answer.

        Raises:
            CallFailed: There is no usable answer.
        """
        ...

    def post(self, service: Service[Any, Any], request: Message) -> None:
        """Send a request at once, from the calling thread, ignoring the answer. Never raises."""
        ...

    def repeat_at_door(self, service: Service[Any, Any], request: Message, called_off: threading.Event) -> None:
        """Send a request at the robot's own door until it has obeyed, or `called_off` is set. Never raises."""
        ...

    def attend(self, *, closely: bool) -> None:
        """Subscribe to all topics of the robot, or (initially) only to those shown of robots out of view."""
        ...

    def fetch_paint(self) -> None:
        """Request everything painted so far; a PaintFetched follows. Does nothing while a request is under way."""
        ...


class Links(Protocol):
    """Links to all robots."""

    def found(self) -> list[tuple[str, Link]]:
        """Return robots found since the last call, by namespace; the first call returns at least one. Never waits.

        The link of a robot that has gone stays, and reports that.
        """
        ...

    def team(self) -> TeamCells | None:
        """Return the message of a team's coordinator since the last call, if any. Never waits."""
        ...

    def queue(self) -> str | None:
        """Return the tasks of a team's dispatcher, as JSON, if there is news of them. Never waits."""
        ...
