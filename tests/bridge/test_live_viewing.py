"""Live drawing in viewers: paint from before anybody looked, ways of a covering tool, and replays that jump."""

import time
from collections.abc import Iterator

import numpy as np
import pytest

from tests.meeting import caught_up
from touchline.bus import Bus, BusConfig, Sample
from touchline.bus.ports import free_port
from touchline.recordings.viewing import Drawn
from touchline.recordings.viewing.viewing import WORK
from touchline.schemas import topics
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import (
    Clock,
    GetPaintResponse,
    Header,
    MarkerArray,
    Odometry,
    PaintMarks,
    Point,
    Pose,
    PoseWithCovariance,
    String,
    Time,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.replay_run import ReplayRun
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.topics import Topic
from touchline.services.bridge.live_viewing import LiveViewing


@pytest.fixture(scope="module")
def robot() -> Iterator[Bus]:
    with Bus.open(topics.TELEMETRY, BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")) as bus:
        yield bus


@pytest.fixture
def viewing(robot: Bus) -> Iterator[LiveViewing]:
    with Bus.open(topics.BRIDGE, robot.config) as bus:
        caught_up(bus, robot)
        yield LiveViewing(bus, "")


def sample(topic: Topic, message: Message, publisher: bytes = b"") -> Sample:
    return Sample(topic, encode(message), 1, 1, publisher)


def setup(vehicle: str) -> Sample:
    told = Setup(vehicle=load_vehicle(vehicle), scenario=Scenario())
    return sample(topics.SETUP, String(data=told.model_dump_json()))


def stroke(first: int, *x_m: float, publisher: bytes = b"", second: int = 0) -> Sample:
    header = Header(frame_id="map", stamp=Time(sec=second))
    x = np.array(x_m)
    marks = PaintMarks(header=header, segment_id="s", first_index=first, width_m=0.1, x_m=x, y_m=0 * x)
    return sample(topics.PAINT, marks, publisher)


def ends(drawn: list[Drawn], topics_drawn: dict[str, MarkerArray]) -> set[float]:
    """All x of the work, by the last message of both topics."""
    topics_drawn |= {each.topic.name: decode(MarkerArray, each.payload) for each in drawn if each.topic in WORK}
    points = (point for array in topics_drawn.values() for marker in array.markers for point in marker.points)
    return {round(point.x, 3) for point in points}


def test_paint_from_before_anybody_looked_is_asked_for_once_and_goes_on(robot: Bus, viewing: LiveViewing) -> None:
    server, shown = robot.serve(topics.GET_PAINT), {}
    assert not viewing.take(stroke(0, 0.0, 1.0))  # nobody looks
    assert viewing.want(WORK) == []
    assert viewing.sources == {topics.SETUP, topics.TEMPLATE, topics.PAINT, topics.CLOCK}
    assert not viewing.take(stroke(1, 1.0, 2.0))  # told again in the answer, so not drawn twice
    assert not viewing.take(stroke(2, 2.0, 3.0, second=5))
    drawn: list[Drawn] = []
    deadline = time.monotonic() + 60.0
    while not drawn:
        assert time.monotonic() < deadline, "waited in vain"
        if (call := server.poll()) is not None:
            call.reply(GetPaintResponse(strokes=(decode(PaintMarks, stroke(0, 0.0, 1.0, 2.0).payload),)))
        drawn = viewing.turn()
    server.close()
    assert ends(drawn, shown) == {0.0, 2.0, 3.0}
    assert ends(viewing.take(stroke(3, 3.0, 4.0, second=9)), shown) == {0.0, 2.0, 4.0}
    viewing.take(stroke(4, 4.0, 5.0, second=9))
    assert 5.0 in ends(viewing.take(sample(topics.CLOCK, Clock(clock=Time(sec=20)))), shown)  # no more is painted


def test_without_an_answer_paint_is_drawn_as_it_comes(viewing: LiveViewing, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("touchline.services.bridge.live_viewing._ASK_AGAIN_S", 0.0)
    viewing.want(WORK)
    viewing.take(stroke(0, 0.0, 1.0))
    drawn: list[Drawn] = []
    deadline = time.monotonic() + 60.0
    while not drawn:
        assert time.monotonic() < deadline, "waited in vain"
        drawn = viewing.turn()
    assert ends(drawn, {}) == {0.0, 1.0}


def test_where_a_covering_tool_has_been_is_known_to_who_looks_later(viewing: LiveViewing) -> None:
    viewing.take(setup("clay-roller"))
    assert viewing.sources == {topics.SETUP, topics.TEMPLATE, topics.TRUTH, topics.CLOCK}
    assert not viewing.sampled
    for tick in range(50):
        pose = PoseWithCovariance(pose=Pose(position=Point(x=0.2 * tick)))
        viewing.take(sample(topics.TRUTH, Odometry(header=Header(stamp=Time(sec=tick), frame_id="map"), pose=pose)))
    places = ends(viewing.want(WORK), {})
    assert max(places) - min(places) == pytest.approx(9.8)


def test_what_a_replay_sent_before_it_jumped_is_void(viewing: LiveViewing) -> None:
    here = ReplayRun(b"abcdef", 1)
    viewing.want([topics.TRANSFORMS])

    def moved(second: int, run: ReplayRun) -> list[Drawn]:
        header = Header(frame_id="map", stamp=Time(sec=second))
        return viewing.take(sample(topics.ODOMETRY, Odometry(header=header), run.publisher_id))

    assert moved(5, here)
    assert moved(2, here.next())
    assert not moved(6, here)
    assert moved(3, here.next())
