"""Links over the real bus, in the only module of the console that imports it."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import zip_longest
from typing import Any

from touchline.bus import Bus, BusConfig, Inbox, Sample, StopProof, repeat_at_door
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.service_messages import GetPaintRequest, GetPaintResponse
from touchline.schemas.messages.standard import String
from touchline.schemas.messages.team_messages import TeamCells
from touchline.schemas.topics import Service, Topic
from touchline.schemas.traversal_state import traversal_state
from touchline.tui.protocol import (
    CallFailed,
    Incoming,
    Link,
    LinkChanged,
    Lost,
    NodeChanged,
    PaintFetched,
    Received,
    Rejected,
    Skimmed,
)
from touchline.tui.reduction import CONSOLE_TOPICS

EVERY_ONE = (topics.PAINT, topics.EVENTS, topics.SUPERVISOR_EVENTS, topics.DIAGNOSTICS)
"""Topics of which every message counts; diagnostics have several publishers."""
CLOSELY = (
    topics.PAINT,
    topics.PLAN,
    topics.TEMPLATE,
    topics.TRUE_COVERAGE,
    topics.REPORT,
    topics.AREA,
    topics.AREA_REPORT,
    topics.OBSTACLES,
    topics.STOP_ZONE,
    topics.SLOW_ZONE,
)
"""Topics that are not subscribed while the robot is out of view."""
SKIMMED_S = 1.0
"""Period of reading the diagnostics of each process while the robot is out of view; their arrival is always noted."""
MOST_FOUND = 8
"""Maximum number of robots that are added at a time: each takes milliseconds, and keys must not wait for hundreds."""
PAINT_TIMEOUT_S = 3.0
POST_TIMEOUT_S = 1.0
"""Lifetime of a request whose answer is ignored."""


@contextmanager
def open_links(config: BusConfig, node: str, *, everyone: bool = False) -> Iterator[BusLinks]:
    """Join the bus as `node`; leaving the context leaves the bus.

    Args:
        config: Bus configuration, with the initial robots.
        node: Name of this process.
        everyone: Whether robots that appear later are added.

    Raises:
        SpecError: The configuration cannot be used.
    """
    with Bus.open_all(node, config) as buses:
        yield BusLinks(buses, everyone=everyone)


__all__ = ["BusConfig", "BusLink", "BusLinks", "open_links"]


class BusLinks:
    """Links over a bus to the named robots, and to those that appear."""

    def __init__(self, buses: Sequence[Bus], *, everyone: bool) -> None:
        """Start listening."""
        self._bus = buses[0]
        self._known = {bus.namespace for bus in buses}
        self._new: list[tuple[str, Link]] = [(bus.namespace, BusLink(bus)) for bus in buses]
        self._roster = self._bus.roster() if everyone else None
        team = self._bus.of(topics.TEAM_NAMESPACE) if everyone else None
        self._team = team.inbox([topics.TEAM_CELLS], keep="latest") if team is not None else None
        self._queue = team.inbox([topics.TEAM_QUEUE], keep="latest") if team is not None else None

    def found(self) -> list[tuple[str, Link]]:
        """Implement `Links`."""
        found, self._new = self._new, []
        if self._roster is not None and not found:  # the initial robots, which are guesses, come first
            self._roster.poll()
            there = self._roster.robots({topics.ROBOT_SIM, topics.REPLAY})
            for name in [name for name in there if name not in self._known][:MOST_FOUND]:
                self._known.add(name)
                found.append((name, BusLink(self._bus.of(name))))
        return found

    def team(self) -> TeamCells | None:
        """Implement `Links`."""
        newest = None
        for _, message in self._team.messages() if self._team is not None else ():
            newest = message if isinstance(message, TeamCells) else newest
        return newest

    def queue(self) -> str | None:
        """Implement `Links`."""
        newest = None
        for _, message in self._queue.messages() if self._queue is not None else ():
            newest = message.data if isinstance(message, String) else newest
        return newest


def _event_of(sample: Sample) -> Incoming:
    """Decode a sample to an event."""
    if not sample.payload:
        return Skimmed(sample.topic.name, sample.publisher.hex())
    try:
        return Received(sample.topic.name, sample.decode(), sample.publisher.hex())
    except PayloadError as error:
        return Rejected(sample.topic.name, str(error))


def _turns(statuses: Sequence[Sample]) -> Iterator[Sample]:
    """Select the last status, and each one before a change of the traversal's state."""
    for status, following in zip_longest(statuses, statuses[1:]):
        if following is None or _state_of(status) != _state_of(following):
            yield status


def _state_of(status: Sample) -> tuple[bytes, int]:
    return status.publisher, traversal_state(status.payload)


class BusLink:
    """`Link` over a bus: inboxes, list of live processes, and calls."""

    def __init__(self, bus: Bus) -> None:
        """Start listening."""
        self._bus = bus
        apart = (*CLOSELY, topics.DIAGNOSTICS, topics.STATUS)
        self._far = self._listen([topic for topic in CONSOLE_TOPICS if topic not in apart])
        self._status = bus.inbox([topics.STATUS], keep="recent")
        self._health = bus.inbox([topics.DIAGNOSTICS], keep="all")
        self._health.skim(SKIMMED_S)
        self._near: list[Inbox] = []
        self._presence = bus.presence()
        self._linked = True
        self._rejected = 0
        self._lost = 0
        self._fetched: deque[PaintFetched] = deque()
        self._fetching = threading.Lock()
        self._proof = StopProof(bus)
        self._posted: object = None
        """Last posted request, referenced while it is under way."""

    def _listen(self, wanted: Sequence[Topic]) -> list[Inbox]:
        """Create inboxes for topics."""
        states = [topic for topic in wanted if topic not in EVERY_ONE]
        lists = [topic for topic in wanted if topic in EVERY_ONE]
        return [self._bus.inbox(states, keep="latest"), self._bus.inbox(lists, keep="all")]

    def attend(self, *, closely: bool) -> None:
        """Implement `Link`."""
        self._near = self._listen(CLOSELY) if closely else []
        self._health.skim(0.0 if closely else SKIMMED_S)

    def poll(self) -> list[Incoming]:
        """Return everything that came in since the last poll.

        Messages of a process come before its end, so that none outlives it.
        """
        came, went = self._presence_changes()
        messages: list[Incoming] = []
        while self._fetched:
            messages.append(self._fetched.popleft())
        messages += [_event_of(sample) for sample in _turns(self._status.drain())]
        for inbox in (*self._far, *self._near, self._health):
            messages += [_event_of(sample) for sample in inbox.drain()]
        return came + messages + went + self._counted()

    def _presence_changes(self) -> tuple[list[Incoming], list[Incoming]]:
        """Return (processes that came, processes that went or were replaced by another instance)."""
        before = self._presence.alive()
        changes = self._presence.poll()
        after = self._presence.alive()
        lost = {change.node for change in changes if not change.alive}
        came: list[Incoming] = []
        went: list[Incoming] = []
        if self._presence.linked != self._linked:
            self._linked = self._presence.linked
            came.append(LinkChanged(self._linked, "" if self._linked else self._bus.config.identity_problem()))
        for node in dict.fromkeys(change.node for change in changes):
            if node in before and node in lost:
                went.append(NodeChanged(node, False))
                if node in after:
                    went.append(NodeChanged(node, True))
            elif node in after:
                came.append(NodeChanged(node, True))
        return came, went

    def _counted(self) -> list[Incoming]:
        """Events of rejected and lost messages."""
        counters, events = self._bus.counters, list[Incoming]()
        for _ in range(counters.rejected - self._rejected):
            topic, _, reason = counters.last_rejection.partition(": ")
            events.append(Rejected(topic, reason))
        self._rejected = counters.rejected
        if counters.lost != self._lost:
            self._lost = counters.lost
            events.append(Lost(counters.lost))
        return events

    def call(self, service: Service[Any, Any], request: Message, timeout_s: float) -> Message:
        """Call a service.

        Raises:
            CallFailed: There is no usable answer.
        """
        try:
            answer: Message = self._proof.call(service, request, timeout_s)
        except Exception as error:  # a closing bus may raise anything
            raise CallFailed(str(error) or type(error).__name__) from error
        return answer

    def repeat_at_door(self, service: Service[Any, Any], request: Message, called_off: threading.Event) -> None:
        """Send a request at the robot's own door until it proves there that it has obeyed, or is called off."""
        with suppress(TouchlineError):  # the bus goes on without the door
            repeat_at_door(service, request, self._bus.node, self._bus.config, called_off)

    def post(self, service: Service[Any, Any], request: Message) -> None:
        """Send a request without waiting for its answer."""
        with suppress(Exception):  # a closing bus may raise anything
            self._posted = self._bus.ask(service, encode(request), POST_TIMEOUT_S)

    def fetch_paint(self) -> None:
        """Fetch everything painted so far from the robot, in a separate thread; one request at a time."""
        if self._fetching.acquire(blocking=False):
            threading.Thread(target=self._fetch_paint, name="fetch-paint", daemon=True).start()

    def _fetch_paint(self) -> None:
        strokes = None
        try:
            response = self.call(topics.GET_PAINT, GetPaintRequest(), PAINT_TIMEOUT_S)
            if isinstance(response, GetPaintResponse):
                strokes = response.strokes
        except CallFailed:
            pass  # the console goes on without, and asks again
        finally:
            self._fetched.append(PaintFetched(strokes))
            self._fetching.release()
