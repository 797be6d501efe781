"""Links over the real bus: the only module of the console that imports it."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import zip_longest
from typing import Any

from touchline.bus import Bus, BusConfig, Inbox, Sample, StopProof, proves
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.service_messages import GetPaintRequest, GetPaintResponse
from touchline.schemas.messages.team_messages import TeamCells
from touchline.schemas.topics import Service, Topic
from touchline.schemas.traversal_state import traversal_state
from touchline.tui.protocol import (
    CallFailed,
    Incoming,
    Link,
    Lost,
    NodeChanged,
    PaintFetched,
    Received,
    Rejected,
    Skimmed,
)
from touchline.tui.state import CONSOLE_TOPICS

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
)
"""Topics of which nothing is shown while the robot is one among others: they are not even sent here then."""
SKIMMED_S = 1.0
"""So often the diagnostics of each process are read while the robot is one among others; that they come is noted."""
MOST_FOUND = 8
"""Robots that are taken up at a time: each takes milliseconds, and keys must not wait for hundreds."""
PAINT_TIMEOUT_S = 3.0
TOLD_TIMEOUT_S = 1.0
"""How long a request that nobody waits for remains under way."""


@contextmanager
def open_links(config: BusConfig, node: str, *, everyone: bool = False) -> Iterator[BusLinks]:
    """Join the bus as `node`; leaving the context leaves the bus.

    Args:
        config: Where the bus is, and the robots to begin with.
        node: This process's name.
        everyone: Whether further robots are taken up as they come.

    Raises:
        SpecError: The configuration cannot be used.
    """
    with Bus.open_all(node, config) as buses:
        yield BusLinks(buses, everyone=everyone)


__all__ = ["BusConfig", "BusLink", "BusLinks", "open_links"]


class BusLinks:
    """Links over a bus: to the robots that are named, and to those that turn up."""

    def __init__(self, buses: Sequence[Bus], *, everyone: bool) -> None:
        """Begin to listen."""
        self._bus = buses[0]
        self._known = {bus.namespace for bus in buses}
        self._new: list[tuple[str, Link]] = [(bus.namespace, BusLink(bus)) for bus in buses]
        self._roster = self._bus.roster() if everyone else None
        self._team = self._bus.of(topics.TEAM_NAMESPACE).inbox([topics.TEAM_CELLS], keep="latest") if everyone else None

    def found(self) -> list[tuple[str, Link]]:
        """See `Links`."""
        found, self._new = self._new, []
        if self._roster is not None and not found:  # those to begin with are guesses, known before any other is found
            self._roster.poll()
            there = self._roster.robots({topics.ROBOT_SIM, topics.REPLAY})
            for name in [name for name in there if name not in self._known][:MOST_FOUND]:
                self._known.add(name)
                found.append((name, BusLink(self._bus.of(name))))
        return found

    def team(self) -> TeamCells | None:
        """See `Links`."""
        newest = None
        for _, message in self._team.messages() if self._team is not None else ():
            newest = message if isinstance(message, TeamCells) else newest
        return newest


def _told(sample: Sample) -> Incoming:
    """What a sample says."""
    if not sample.payload:
        return Skimmed(sample.topic.name, sample.publisher.hex())
    try:
        return Received(sample.topic.name, sample.decode(), sample.publisher.hex())
    except PayloadError as error:
        return Rejected(sample.topic.name, str(error))


def _turns(statuses: Sequence[Sample]) -> Iterator[Sample]:
    """Of the statuses that have come the last, and each after which the traversal's state is another."""
    for status, following in zip_longest(statuses, statuses[1:]):
        if following is None or _state_told(status) != _state_told(following):
            yield status


def _state_told(status: Sample) -> tuple[bytes, int]:
    return status.publisher, traversal_state(status.payload)


class BusLink:
    """A Link over a bus: inboxes, the list of live processes, and calls."""

    def __init__(self, bus: Bus) -> None:
        """Begin to listen."""
        self._bus = bus
        apart = (*CLOSELY, topics.DIAGNOSTICS, topics.STATUS)
        self._far = self._listen([topic for topic in CONSOLE_TOPICS if topic not in apart])
        self._status = bus.inbox([topics.STATUS], keep="recent")
        self._health = bus.inbox([topics.DIAGNOSTICS], keep="all")
        self._health.skim(SKIMMED_S)
        self._near: list[Inbox] = []
        self._presence = bus.presence()
        self._rejected = 0
        self._lost = 0
        self._fetched: deque[PaintFetched] = deque()
        self._fetching = threading.Lock()
        self._proof = StopProof(bus)
        self._told: object = None
        """The last question that nobody waits for, which is held while it is under way."""

    def _listen(self, wanted: Sequence[Topic]) -> list[Inbox]:
        """Inboxes of these topics."""
        states = [topic for topic in wanted if topic not in EVERY_ONE]
        lists = [topic for topic in wanted if topic in EVERY_ONE]
        return [self._bus.inbox(states, keep="latest"), self._bus.inbox(lists, keep="all")]

    def attend(self, *, closely: bool) -> None:
        """See `Link`."""
        self._near = self._listen(CLOSELY) if closely else []
        self._health.skim(0.0 if closely else SKIMMED_S)

    def poll(self) -> list[Incoming]:
        """Everything that came in since the last poll.

        What a process said before it went comes before its end, so that nothing of it outlives it.
        """
        came, went = self._presence_changes()
        said: list[Incoming] = []
        while self._fetched:
            said.append(self._fetched.popleft())
        said += [_told(sample) for sample in _turns(self._status.drain())]
        for inbox in (*self._far, *self._near, self._health):
            said += [_told(sample) for sample in inbox.drain()]
        return came + said + went + self._counted()

    def _presence_changes(self) -> tuple[list[Incoming], list[Incoming]]:
        """(who came, who went or was replaced by another instance)."""
        before = self._presence.alive()
        changes = self._presence.poll()
        after = self._presence.alive()
        lost = {change.node for change in changes if not change.alive}
        came: list[Incoming] = []
        went: list[Incoming] = []
        for node in dict.fromkeys(change.node for change in changes):
            if node in before and node in lost:
                went.append(NodeChanged(node, False))
                if node in after:
                    went.append(NodeChanged(node, True))
            elif node in after:
                came.append(NodeChanged(node, True))
        return came, went

    def _counted(self) -> list[Incoming]:
        """What the bus itself turned away or found missing."""
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
        """Ask a service. Raises CallFailed when there is no usable answer."""
        try:
            answer: Message = self._bus.call(service, request, timeout_s)
            doubt = self._proof.lacking(service.name, timeout_s) if proves(service.name) else ""
        except Exception as error:  # a bus that is being left raises whatever it pleases
            raise CallFailed(str(error) or type(error).__name__) from error
        if doubt and getattr(answer, "success", True):
            raise CallFailed(doubt)
        return answer

    def tell(self, service: Service[Any, Any], request: Message) -> None:
        """Send a request without waiting for its answer."""
        with suppress(Exception):  # a bus that is being left raises whatever it pleases
            self._told = self._bus.ask(service, encode(request), TOLD_TIMEOUT_S)

    def fetch_paint(self) -> None:
        """Ask the robot for everything painted so far, in a thread of its own; one at a time."""
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
