"""Viewers' drawings of a session, made from the messages of a shipped one."""

from pathlib import Path

import numpy as np
import pytest

from touchline.recordings.channels import topic_at
from touchline.recordings.reader import RecordingReader
from touchline.recordings.viewing import Viewing
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import (
    Header,
    Marker,
    MarkerArray,
    NavPath,
    Obstacle,
    Obstacles,
    Odometry,
    PaintMarks,
    String,
    TFMessage,
    Time,
    Trajectory,
)

SESSION = Path(__file__).resolve().parents[2] / "examples" / "sessions" / "square.mcap"


@pytest.fixture(scope="module")
def said():
    """The session's messages by topic, and those for viewers."""
    viewing, heard, drawn = Viewing(), {}, {}
    for message in RecordingReader(SESSION).messages():
        topic = topic_at(message.topic)
        heard.setdefault(topic.name, []).append(decode(topic.type, message.payload))
        for each in viewing.take(topic.name, message.payload):
            drawn.setdefault(each.topic.name, []).append(decode(each.topic.type, each.payload))
    return heard, drawn


@pytest.mark.parametrize(
    ("source", "name", "frame"),
    [("odometry/filtered", "tf", "base_link"), ("truth/odometry", "truth/tf", "base_link_truth")],
)
def test_every_fifth_pose_becomes_a_transform(said, source, name, frame):
    heard, drawn = said
    assert len(drawn[name]) > 100
    poses = heard[source]
    assert len(poses) == pytest.approx(5 * len(drawn[name]), abs=5)
    for message in drawn[name]:
        (moved,) = message.transforms
        assert moved.child_frame_id == frame
        at, turned = moved.transform.translation, moved.transform.rotation
        assert any(
            (each.header, each.pose.pose.orientation, each.pose.pose.position.x, each.pose.pose.position.y)
            == (moved.header, turned, at.x, at.y)
            for each in poses
        )


def test_the_template_the_plan_and_the_body_are_drawn_once(said):
    _, drawn = said
    (markers,), (path,), (fixed,) = drawn["template/markers"], drawn["plan/path"], drawn["tf_static"]
    assert {each.ns for each in markers.markers if each.action == Marker.ADD} == {"lines"}
    assert len({each.id for each in markers.markers if each.ns == "lines"}) == 4
    assert len(path.poses) > 4
    assert {each.child_frame_id for each in fixed.transforms} == {"gnss_link", "imu_link", "tool_link"}
    assert {each.header.frame_id for each in drawn["body/markers"][0].markers} == {"base_link"}


def test_the_last_message_of_both_work_topics_shows_all_paint():
    viewing, strokes, last = Viewing(), 400, {}
    for number in range(strokes):
        header = Header(frame_id="map", stamp=Time(sec=2 * number))
        marks = PaintMarks(
            header=header,
            segment_id=f"s{number}",
            first_index=3 * number,
            width_m=0.1,
            x_m=np.array([0.0, 1.0, 2.0]),
            y_m=np.full(3, 0.2 * number),
        )
        for each in viewing.take(topics.PAINT.name, encode(marks)):
            last[each.topic.name] = decode(MarkerArray, each.payload)
    found = [point for name in last for marker in last[name].markers for point in marker.points]
    assert {round(point.y / 0.2) for point in found} == set(range(strokes))
    assert len(found) == 2 * strokes  # the point in the middle of a straight stroke says nothing
    assert len(last["truth/ground/latest_markers"].markers[0].points) <= 2 * 64


def test_frames_of_several_robots_differ():
    drawn = Viewing("r01/").take(topics.ODOMETRY.name, encode(Odometry(header=Header(frame_id="map"))))
    assert decode(TFMessage, drawn[0].payload).transforms[0].child_frame_id == "r01/base_link"


def test_what_is_no_message_of_its_topic_draws_nothing():
    viewing = Viewing()
    assert not viewing.take(topics.SETUP.name, b"")
    assert not viewing.take(topics.PLAN.name, b"\0\1\0\0")
    (path,) = viewing.take(topics.PLAN.name, encode(Trajectory()))
    assert decode(NavPath, path.payload).poses == ()


def test_obstacles_are_drawn_by_what_they_are():
    square = {"outline_x_m": np.array([1.0, 2.0, 2.0]), "outline_y_m": np.array([1.0, 1.0, 2.0])}
    person = Obstacle(id=7, kind="person", moving=True, x_m=1.5, y_m=1.5, vx_mps=1.0, vy_mps=-0.5, **square)
    post, known = Obstacle(id=8, kind="post", x_m=4.0, **square), Obstacle(id=0, known=True, kind="thing", **square)
    seen = Obstacles(header=Header(frame_id="map", stamp=Time(sec=3)), obstacles=(person, post, known))
    (message,) = Viewing().take(topics.OBSTACLES.name, encode(seen))
    (drawn,) = decode(MarkerArray, message.payload).markers
    assert (drawn.header.frame_id, drawn.type, drawn.lifetime.sec) == ("map", Marker.LINE_LIST, 1)
    assert len(drawn.points) == len(drawn.colors) == 2 * (3 + 3 + 3 + 3)
    assert len(set(map(repr, drawn.colors))) == 3
    assert drawn.colors[-1].r == drawn.colors[-1].g == drawn.colors[-1].b
    tail, head = drawn.points[6:8]
    assert (tail.x, tail.y, head.x, head.y) == (1.5, 1.5, 2.5, 1.0)
    (none,) = Viewing().take(topics.OBSTACLES.name, encode(Obstacles()))
    assert [each.action for each in decode(MarkerArray, none.payload).markers] == [Marker.DELETE]


@pytest.mark.parametrize("broken", [{"moving": True, "x_m": float("nan")}, {"outline_x_m": np.zeros(2)}])
def test_obstacles_without_a_place_are_not_drawn(broken):
    assert not Viewing().take(topics.OBSTACLES.name, encode(Obstacles(obstacles=(Obstacle(**broken),))))


def test_areas_are_filled_and_their_holes_are_not():
    template = load_template("salt-pan-pond")
    (message,) = Viewing().take(topics.TEMPLATE.name, encode(String(data=template.to_json())))
    drawn = decode(MarkerArray, message.payload).markers
    (area,), (fill,) = template.areas, [marker for marker in drawn if marker.ns == "areas"]
    corners = np.array([(point.x, point.y) for point in fill.points]).reshape(-1, 3, 2)
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    assert np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() / 2 == pytest.approx(area.polygon.area)
