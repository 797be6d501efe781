"""The common recording of robots in one process: each one's session, which today's code drives to the same bytes."""

import pytest

from tests.painted import read_painted
from tests.planner.drawn import drawn
from tests.sharing.stretches import nearest_m
from touchline.checking.check_session import check_recording
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.jobs.shared.shared_job import APART_M, share_job
from touchline.jobs.shared.shared_simulation import simulate_shared
from touchline.jobs.shared.team_order import TeamOrder
from touchline.jobs.shared.team_picture import draw_recorded
from touchline.jobs.single.geojson_map import geojson_map
from touchline.jobs.single.recorded_paint import read_all_painted
from touchline.recordings.reader import RecordingReader
from touchline.schemas.cdr import decode
from touchline.schemas.messages import NavPath, PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle

pytestmark = pytest.mark.xdist_group("shared recording")  # by one worker, so that it is recorded once
TEMPLATE = drawn((0.0, 0.0, 4.0, 0.0), (5.5, 0.0, 9.5, 0.0))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A file in which one fails, the other takes over, and does the rest once that is carried away; and the outcome."""
    path = tmp_path_factory.mktemp("recorded") / "two.mcap"
    job = share_job(TEMPLATE, PlanOptions(), Vehicle(), [None] * 2)
    assert job.table.gates, "one is told how far it may drive"
    last = job.table.gates[0].robot
    orders = [TeamOrder(4.0, last, "fail"), TeamOrder(20.0, last, "remove"), TeamOrder(20.0, last, "take-over")]
    setups = [Setup().with_seed(seed) for seed in (1, 2)]
    with PayloadRecorder(path, ("r1", "r2")) as recorder:
        outcome = simulate_shared(job, setups, orders, listener=recorder.hear)
    assert recorder.figures()["complete"]
    return path, outcome


def test_every_session_in_it_comes_out_the_same_again(recorded):
    path, outcome = recorded
    assert outcome.reason == "" and sorted(map(len, outcome.robots)) == [1, 2]
    checks = check_recording(path)
    assert [(check.robot, check.problem, check.first) for check in checks] == [("r1", "", None), ("r2", "", None)]


def test_the_stretches_that_both_claim_are_in_it_and_never_near_each_other(recorded):
    path, _ = recorded
    claimed = {f"/{robot}/traversal/claimed": robot for robot in ("r1", "r2")}
    told = [(claimed[each.topic], decode(NavPath, each.payload)) for each in RecordingReader(path).messages(claimed)]
    assert nearest_m(told, Vehicle()) >= APART_M
    for robot in claimed.values():
        own = [path for name, path in told if name == robot]
        assert own[0].poses and not own[-1].poses, "until it is done"
        assert {each.header.frame_id for path in own for each in path.poses} == {"map"}


def test_the_paint_of_each_is_in_it(recorded):
    path, outcome = recorded
    for name, tasks in zip(("r1", "r2"), outcome.robots, strict=True):
        drawn = read_painted(path, name)
        assert [len(stroke.x_m) for stroke in drawn.strokes] == [len(stroke.x_m) for stroke in tasks[-1].strokes]


def test_picture_and_map_without_a_name_have_all_that_each_has_painted(recorded, tmp_path):
    path, outcome = recorded
    picture = tmp_path / "both.svg"
    draw_recorded(read_all_painted(path), picture)
    assert all(f"<!-- {text} -->" in picture.read_text() for text in ("2 robots", "r1", "r2"))
    properties = [feature["properties"] for feature in geojson_map(path)["features"]]
    painted = [each for each in properties if each["is"] == "paint"]
    for name, tasks in zip(("r1", "r2"), outcome.robots, strict=True):
        strokes = [stroke for task in tasks for stroke in task.strokes if len(stroke.x_m) > 1]
        assert [each["id"] for each in painted if each["robot"] == name] == [stroke.segment_id for stroke in strokes]
    alone = geojson_map(path, "r1")["features"]
    assert 0 < len(alone) < len(properties) and "robot" not in alone[0]["properties"]
