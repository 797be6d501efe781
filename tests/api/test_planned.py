"""Plans from Python: as arrays, files and pictures."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import touchline


@pytest.fixture(scope="module")
def square() -> touchline.Plan:
    return touchline.plan("study-square", paint_speed_mps=0.4)


def test_a_path_is_the_plan_sampled(square: touchline.Plan) -> None:
    path = square.path(0.05)
    assert path["time_s"][-1] == pytest.approx(square.duration_s, abs=1e-6)
    assert path["station_m"][-1] == pytest.approx(square.length_m, abs=1e-9)
    assert (np.diff(path["time_s"]) >= 0.0).all()
    moved = np.hypot(np.diff(path["x_m"]), np.diff(path["y_m"]))
    assert moved.max() <= 0.05 + 1e-9
    assert moved.sum() == pytest.approx(square.length_m, rel=1e-3)
    driven = np.diff(path["time_s"]) > 0.0
    speed = (np.diff(path["station_m"])[driven] / np.diff(path["time_s"])[driven]).max()
    assert speed <= np.abs(path["speed_mps"]).max() + 1e-6
    assert square.at(0.0)["station_m"] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        path["x_m"] = 0.0


@pytest.mark.parametrize(("vehicle", "backward"), [("turf-tank-two", True), ("turtlebot3-waffle-pi", False)])
def test_the_heading_follows_the_path_backward_and_on_the_spot_too(vehicle: str, backward: bool) -> None:
    lines = {"a": [[0, 0], [6, 0]], "b": [[6, 0.5], [0, 0.5]], "c": [[0, 1], [6, 1]]}
    segments = [{"id": name, "line": {"start": start, "end": end}} for name, (start, end) in lines.items()]
    plan = touchline.plan({"name": "close", "segments": segments}, vehicle=vehicle, order="given")
    path, table = plan.path(0.02), plan.segments
    heading = np.unwrap(path["heading_rad"])
    east, north = np.diff(path["x_m"]), np.diff(path["y_m"])
    ahead = east * np.cos(heading[1:]) + north * np.sin(heading[1:])
    moving = np.diff(path["station_m"]) > 1e-6
    assert (np.sign(ahead[moving]) == table["direction"][path["segment"][1:][moving]]).all()
    assert (path["speed_mps"] * table["direction"][path["segment"]] >= 0.0).all()
    assert (path["speed_mps"] < -0.05).any() == backward
    turning = ~moving & (np.diff(path["time_s"]) > 0.0)
    assert np.diff(heading)[turning].sum() == pytest.approx(table["turn_rad"].sum(), abs=1e-6)
    assert (table["turn_rad"] != 0.0).any() != backward


def test_segments_tell_where_paint_is(square: touchline.Plan) -> None:
    segments = square.segments
    painted = segments[segments["working"]]
    assert (painted["end_m"] - painted["start_m"]).sum() == pytest.approx(square.template.length_m, abs=0.01)
    assert segments["end_s"][-1] == pytest.approx(square.duration_s)
    assert (segments["start_m"][1:] == segments["end_m"][:-1]).all()


def test_a_plan_is_kept_in_a_file_and_goes_to_other_processes(square: touchline.Plan, tmp_path: Path) -> None:
    square.save(tmp_path / "plan.json")
    again = touchline.Plan.load(tmp_path / "plan.json")
    assert again == square and again.hash == square.hash
    assert pickle.loads(pickle.dumps(square)) == square
    square.save(tmp_path / "plan.svg")
    assert (tmp_path / "plan.svg").read_text(encoding="utf-8").lstrip().startswith("<?xml")
    assert "<svg" in again._repr_html_()
    (tmp_path / "no.json").write_text('{"template": {}}', encoding="utf-8")
    with pytest.raises(touchline.SpecError, match=r"name is missing"):
        touchline.Plan.load(tmp_path / "no.json")


def test_a_wrong_keyword_names_the_right_one() -> None:
    with pytest.raises(touchline.SpecError, match="did you mean 'paint_speed_mps'"):
        touchline.plan("study-square", paint_speed=0.4)
    with pytest.raises(touchline.SpecError, match="neither a shipped template nor a file"):
        touchline.plan("study-sqare")
    with pytest.raises(touchline.SpecError) as caught:
        touchline.plan("study-square", paint_speed_mps=-1.0)
    assert caught.value.field == "paint_speed_mps" and caught.value.remedy


def test_a_vehicle_is_changed_by_a_copy_that_is_checked() -> None:
    robot = touchline.load_vehicle("turf-tank-two")
    wider = robot.replace("drive.track_width_m", 0.62)
    assert wider.drive.track_width_m == 0.62 and robot.drive.track_width_m != 0.62
    with pytest.raises(touchline.SpecError, match="track_width_m is -1"):
        robot.replace("drive.track_width_m", -1)
    with pytest.raises(touchline.SpecError, match="is not a field"):
        robot.replace("drive.track", 1)
    moved = robot.replace("body.footprint_m.0", (1.0, 0.5))
    assert moved.body.footprint_m[0] == (1.0, 0.5)


def test_planning_can_be_watched_and_ended() -> None:
    steps: list[tuple[float, str]] = []
    touchline.plan("study-square", progress=lambda done, doing: steps.append((done, doing)))
    assert steps and all(0.0 <= done <= 1.0 and doing for done, doing in steps)

    def enough(_done: float, _doing: str) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        touchline.plan("study-square", progress=enough)
    assert math.isfinite(touchline.plan("study-square", stop=lambda: True).duration_s)


def test_a_template_given_as_a_mapping_is_what_its_file_would_be() -> None:
    line = {"id": "a", "line": {"start": [0, 0], "end": [4, 0]}}
    placed = touchline.load_template({"name": "one", "segments": [line], "placement": {"x_m": 10, "rotation_deg": 90}})
    assert placed.segments[0].line is not None and placed.segments[0].line.end == pytest.approx((10.0, 4.0))
    with pytest.raises(touchline.SpecError, match="length is a parameter of no drawing"):
        touchline.load_template("field.svg", length=3)
    with pytest.raises(touchline.SpecError, match="latitude_deg"):
        touchline.load_template("tennis", origin=(95.0, 10.0))
