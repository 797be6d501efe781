"""Messages that waited in a channel each come back into the order in which they were sent."""

from collections import deque
from dataclasses import dataclass

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from touchline.schemas import topics
from touchline.schemas.topics import Topic
from touchline.services.bridge.sequencer import Sequencer

CHANNELS = (topics.CLOCK, topics.IMU, topics.PAINT)


@dataclass(frozen=True)
class Sent:
    topic: Topic
    source_time_ns: int
    sequence: int = 0
    payload: bytes = b""
    missed: int = 0
    publisher: bytes = b""
    namespace: str = "tt2"


@given(
    st.lists(st.one_of(st.sampled_from(CHANNELS), st.just("drain one channel")), max_size=60),
    st.sampled_from((1, 3, 60)),
)
@example([topics.CLOCK] * 5 + [topics.IMU] * 5, 1)
def test_any_interleaving_of_sending_and_draining_is_undone(course: list[Topic | str], most: int) -> None:
    """``course`` is what happens one after another: a message arrives, or `most` are taken from the next channel."""
    waiting: dict[str, deque[Sent]] = {topic.name: deque() for topic in CHANNELS}
    sequencer, batch, cut, out, sent, turn = Sequencer(), [], set(), [], [], 0
    for step in [*course, *["drain one channel"] * (9 + len(CHANNELS) * len(course) // most)]:
        if isinstance(step, Topic):
            sent.append(Sent(step, len(sent) + 1))
            waiting[step.name].append(sent[-1])
            continue
        channel = waiting[CHANNELS[turn % len(CHANNELS)].name]
        taken = [channel.popleft() for _ in range(min(most, len(channel)))]
        batch += taken
        if len(taken) == most:
            cut.add(taken[-1].topic.name)
        turn += 1
        if turn % len(CHANNELS) == 0:
            out += sequencer.take(batch, cut)
            batch, cut = [], set()
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


@pytest.mark.parametrize("step_s", [-3600, -3, -0.3, 3600])
@pytest.mark.parametrize("at", [1, 150, 151, 160])
def test_a_clock_that_is_set_loses_nothing_and_keeps_the_order(step_s: float, at: int) -> None:
    """300 messages of three topics at 100 Hz and 10 Hz, taken in batches of any size, and the clock set in between."""
    sent, numbers = [], {topic.name: 0 for topic in CHANNELS}
    for tick in range(300):
        wall_ns = 10**18 + tick * 10**7 + (round(step_s * 1e9) if tick >= at else 0)
        for topic in CHANNELS if tick % 10 == 0 else CHANNELS[1:2]:
            numbers[topic.name] += 1
            sent.append(Sent(topic, wall_ns + len(sent) % 7, numbers[topic.name], publisher=topic.name.encode()))
    sequencer, out = Sequencer(), []
    for begin in range(0, len(sent), 17):
        batch = sent[begin : begin + 17]
        out += sequencer.take([message for topic in CHANNELS for message in batch if message.topic is topic])
    out += sequencer.rest()
    assert len(out) == len(sent)
    for topic in CHANNELS:
        assert [m.sequence for m in out if m.topic is topic] == [m.sequence for m in sent if m.topic is topic]
    # Across topics, a message is at most a period of the slowest topic away from where it was sent.
    places = {id(message): place for place, message in enumerate(sent)}
    assert max(abs(place - places[id(message)]) for place, message in enumerate(out)) <= 13
