"""Viewers' drawing of a robot on the bus, from whenever somebody looks."""

from __future__ import annotations

import time
from collections.abc import Collection
from typing import Final

from touchline.bus import Bus, Sample
from touchline.bus.calls import Question
from touchline.recordings.viewing.body_frames import stamp_of
from touchline.recordings.viewing.viewing import SOURCES_OF, WORK, Drawn, Viewing
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import GetPaintRequest, GetPaintResponse, PaintMarks
from touchline.schemas.replay_run import Belonging, ReplayFollower
from touchline.schemas.topics import Topic

_ANSWER_S: Final = 10.0
_ASK_AGAIN_S: Final = 1.0
#: A robot without an answer after so many requests has no paint record: no real one has.
_MOST_QUESTIONS: Final = 5
#: Taken whenever they come: they are few, and nothing can be drawn without.
_ALWAYS: Final = frozenset((topics.SETUP.name, topics.TEMPLATE.name, topics.PLAN.name))


class LiveViewing:
    """Draws wanted topics for viewers as the robot's messages come; call `turn` often.

    Existing paint is fetched by `truth/get_paint`. The ground of a covering tool cannot be fetched afterwards: once it
    is known that the tool covers, its path is followed whether anybody looks or not.

    Args:
        bus: Bus of the robot.
        prefix: Prefix of the robot's own frames.
    """

    def __init__(self, bus: Bus, prefix: str) -> None:
        self._bus = bus
        self._prefix = prefix
        self._viewing = Viewing(prefix)
        self._replay = ReplayFollower()
        self._wanted: frozenset[Topic] = frozenset()
        self._sources = _ALWAYS
        self._question: Question | None = None
        self._asked = 0
        self._ask_s = 0.0
        self._held: list[bytes] = []

    @property
    def sampled(self) -> set[Topic]:
        """Those of its `sources` of which the latest message now and then suffices: positions of frames."""
        return set() if self._viewing.covers else {topics.ODOMETRY, topics.TRUTH}

    @property
    def sources(self) -> set[Topic]:
        """Topics that it needs now."""
        needed = {topics.SETUP, *(source for topic in self._wanted for source in SOURCES_OF[topic])}
        return needed | {topics.TEMPLATE, topics.TRUTH, topics.CLOCK} if self._viewing.covers else needed

    def want(self, wanted: Collection[Topic]) -> list[Drawn]:
        """Set the viewers' topics that are looked at from now on; return what is drawn for that."""
        before, self._wanted = self._wanted, frozenset(wanted)
        self._heed()
        if not self._wanted & WORK:
            self._asked = 0
        elif not before & WORK:
            self._fetch()
            return self._viewing.whole_work() if self._viewing.covers else []
        return []

    def _heed(self) -> None:
        self._sources = _ALWAYS | {topic.name for topic in self.sources}

    def take(self, sample: Sample) -> list[Drawn]:
        """Return what is drawn from a message."""
        name, payload = sample.topic.name, sample.payload
        if name not in self._sources:
            return []
        heard = self._replay.hear(sample.publisher)
        if heard is Belonging.VOID:
            return []
        if heard is Belonging.JUMP:
            self._viewing = Viewing(self._prefix)
            self._fetch()
        if name == topics.CLOCK.name:
            return self._viewing.pass_time(stamp_of(payload))
        if name == topics.PAINT.name:
            if sample.missed:
                self._fetch()
            if self._asked:
                self._held.append(payload)
                return []
        drawn = self._viewing.take(name, payload)
        if name == topics.TEMPLATE.name:  # it has removed all work
            self._fetch()
        elif name == topics.SETUP.name:
            self._heed()
        return drawn

    def turn(self) -> list[Drawn]:
        """Return what is drawn from the robot's answers."""
        if not self._asked:
            return []
        if self._question is None:
            if time.monotonic() >= self._ask_s:
                self._question = self._bus.ask(topics.GET_PAINT, encode(GetPaintRequest()), _ANSWER_S)
            return []
        answer = self._question.poll()
        if answer is None:
            return []
        self._question = None
        try:
            if answer.payload is not None:
                return self._restore(decode(GetPaintResponse, answer.payload).strokes)
        except PayloadError as error:
            self._bus.counters.reject(f"{topics.GET_PAINT.name}: {error}")
        self._asked, self._ask_s = self._asked + 1, time.monotonic() + _ASK_AGAIN_S
        return self._go_on(0) if self._asked > _MOST_QUESTIONS else []

    def _fetch(self) -> None:
        """Fetch all paint; batches that come until then are held."""
        if self._wanted & WORK and not self._viewing.covers:
            self._asked, self._question, self._ask_s = 1, None, 0.0
            self._held.clear()

    def _restore(self, strokes: tuple[PaintMarks, ...]) -> list[Drawn]:
        drawn = self._viewing.restore_paint(strokes)
        return drawn + self._go_on(strokes[-1].first_index + len(strokes[-1].x_m) if strokes else 0)

    def _go_on(self, known: int) -> list[Drawn]:
        """Draw batches of paint again, first the held ones, except points below that number."""
        held, self._held, self._asked = self._held, [], 0
        drawn: list[Drawn] = []
        for payload in held:
            marks = decode(PaintMarks, payload)
            if marks.first_index + len(marks.x_m) > known:
                drawn += self._viewing.take(topics.PAINT.name, payload)
        return drawn
