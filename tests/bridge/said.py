"""Messages as the robot sends them, and recordings made of them."""

from collections.abc import Iterator
from pathlib import Path

from touchline.recordings.channels import is_drawn
from touchline.recordings.recorded import Summary
from touchline.recordings.recorder import Recorder
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import (
    Clock,
    Header,
    Imu,
    JointState,
    Message,
    PaintMarks,
    String,
    Time,
    TraversalStatus,
    Vector3,
)
from touchline.schemas.topics import Topic

TICK_NS = 10_000_000


def stamp(tick: int) -> Time:
    """Sim time of a tick of 10 ms."""
    return Time(sec=tick // 100, nanosec=tick % 100 * TICK_NS)


def messages(ticks: int, rate_radps: float = 0.5) -> Iterator[tuple[Topic, Message]]:
    """Messages of a small robot in ``ticks`` ticks: one text without a stamp, then topics at 100 Hz and 10 Hz."""
    yield topics.TEMPLATE, String(data='{"name": "square"}')
    for tick in range(ticks):
        header = Header(stamp=stamp(tick), frame_id="base_link")
        if tick % 10 == 0:
            yield topics.CLOCK, Clock(clock=stamp(tick))
            yield topics.STATUS, TraversalStatus(header=header, painted_ids=("a",), painted_fraction=[tick / ticks])
            yield (
                topics.PAINT,
                PaintMarks(header=header, segment_id="a", first_index=tick, x_m=[0.0, tick], y_m=[1.0, 2.0]),
            )
        yield topics.IMU, Imu(header=header, angular_velocity=Vector3(z=rate_radps * tick))
        yield topics.JOINT_STATES, JointState(header=header, name=("left_wheel", "right_wheel"), position=[tick, -tick])


def record(path: Path, said: Iterator[tuple[Topic, Message]]) -> Recorder:
    """A recorder, not finished, that has taken all that was said."""
    recorder = Recorder(path)
    sequences: dict[str, int] = {}
    for topic, message in said:
        sequences[topic.name] = sequences.get(topic.name, -1) + 1
        recorder.write(topic.name, encode(message), sequences[topic.name])
    return recorder


def sent(held: Summary) -> int:
    """Messages in a recording but for those that were made for viewers."""
    return sum(topic.messages for name, topic in held.topics.items() if not is_drawn(name, ("tt2",)))
