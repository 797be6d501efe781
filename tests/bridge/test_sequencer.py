"""Messages that waited in a channel each come back into the order in which they were sent."""

from collections import deque
from dataclasses import dataclass

from hypothesis import given
from hypothesis import strategies as st

from schemas import topics
from schemas.topics import Topic
from services.bridge.sequencer import Sequencer

CHANNELS = (topics.CLOCK, topics.IMU, topics.PAINT)


@dataclass(frozen=True)
class Sent:
    topic: Topic
    source_time_ns: int
    sequence: int = 0
    payload: bytes = b""
    missed: int = 0


@given(st.lists(st.one_of(st.sampled_from(CHANNELS), st.just("drain one channel")), max_size=60))
def test_any_interleaving_of_sending_and_draining_is_undone(course: list[Topic | str]) -> None:
    """``course`` is what happens one after another: a message arrives, or the next channel in turn is emptied."""
    waiting: dict[str, deque[Sent]] = {topic.name: deque() for topic in CHANNELS}
    sequencer, batch, out, sent, turn = Sequencer(), [], [], [], 0
    for step in [*course, *["drain one channel"] * 9]:
        if isinstance(step, Topic):
            sent.append(Sent(step, len(sent)))
            waiting[step.name].append(sent[-1])
            continue
        channel = waiting[CHANNELS[turn % len(CHANNELS)].name]
        batch += channel
        channel.clear()
        turn += 1
        if turn % len(CHANNELS) == 0:
            out += sequencer.take(batch)
            batch = []
    out += sequencer.take(batch)
    assert out + sequencer.rest() == sent


def test_a_quiet_round_releases_what_was_held() -> None:
    sequencer = Sequencer()
    message = Sent(topics.IMU, 5)
    assert sequencer.take([message]) == []
    assert sequencer.take([]) == [message]
    assert sequencer.take([]) == sequencer.rest() == []


def test_messages_of_one_time_keep_their_order() -> None:
    sequencer = Sequencer()
    messages = [Sent(topics.IMU, 5, sequence) for sequence in range(4)]
    assert sequencer.take(messages[:2]) + sequencer.take(messages[2:]) == messages
