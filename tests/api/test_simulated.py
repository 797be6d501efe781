"""Simulations from Python: the bits of the command, and tables of the drive."""

import math
import multiprocessing
import threading
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import touchline

#: Of `touchline simulate study-square --hash`.
HASH = "ae51b8a8841a9c4a"


def pursue(state: touchline.FollowerState, ahead: touchline.FollowerAhead) -> tuple[float, float]:
    """Pure pursuit of the reference 50 ms ahead."""
    speed = float(ahead.speed_mps[5])
    return speed, float(ahead.yaw_rate_radps[5]) - 5.7 * abs(speed) * (state.lateral_m / 0.35 + state.heading_error_rad)


def hash_of(seed: int) -> str:
    return touchline.simulate("study-square", seed=seed).hash


@pytest.fixture(scope="module")
def run() -> touchline.Run:
    return touchline.simulate("study-square")


def test_a_run_is_the_session_of_the_command(run: touchline.Run) -> None:
    assert run.success and run.reason == "" and run.hash == HASH and run.seed == 1
    assert [event.code for event in run.events] == ["ready", "running", "done"]
    assert "<svg" in run._repr_html_() and "done" in repr(run)


def test_a_run_is_the_same_in_threads_and_processes() -> None:
    found: list[str] = []
    threads = [threading.Thread(target=lambda: found.append(hash_of(1))) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        found.append(pool.submit(hash_of, 1).result())
    assert found == [HASH] * 3


def test_a_frame_has_the_errors_of_the_report(run: touchline.Run) -> None:
    frame = run.frame(kind="numpy")
    assert frame["time_s"][-1] == pytest.approx(len(frame) / 100.0)
    painting = frame[frame["valve_open"]]  # paint falls a moment after the valve opens
    assert np.abs(painting["lateral_error_m"]).mean() == pytest.approx(run.errors()["lateral_mean_m"], abs=5e-5)
    assert np.abs(painting["lateral_error_m"]).max() == pytest.approx(run.errors()["lateral_max_m"], abs=1e-5)
    # Off by what the estimate is off.
    believed = np.abs(painting["lateral_belief_m"] - painting["lateral_error_m"])
    assert believed.max() < 5.0 * run.errors()["position_rmse_m"]
    assert frame["station_m"].max() == pytest.approx(run.plan.length_m, abs=0.02)
    assert set(frame["state"]) == {"running", "done"}


def test_a_frame_has_every_position_report_once(run: touchline.Run, tmp_path: Path) -> None:
    frame = run.frame(kind="numpy")
    recorded = run.record(tmp_path / "session.mcap")
    assert recorded.hash == run.hash
    fixes = touchline.Recording(tmp_path / "session.mcap")["gnss/fix"].array()
    arrived = frame[frame["gnss_arrived"]]
    # Those of the first second arrived before the robot set out.
    assert arrived["gnss_latitude_deg"].tolist() == fixes["latitude"][-len(arrived) :].tolist()
    assert np.isnan(frame["gnss_latitude_deg"][~frame["gnss_arrived"]]).all()


def test_rows_are_picked_and_columns_chosen(run: touchline.Run) -> None:
    whole, tenth = run.frame(kind="numpy"), run.frame(rate_hz=10, columns=["time_s", "truth_x_m"], kind="numpy")
    assert tenth.dtype.names == ("time_s", "truth_x_m")
    assert (tenth["truth_x_m"] == whole["truth_x_m"][::10]).all()
    with pytest.raises(touchline.SpecError, match="did you mean 'lateral_error_m'"):
        run.frame(columns=["lateral_eror_m"])
    with pytest.raises(touchline.SpecError, match="give 100, 50"):
        run.frame(rate_hz=30)


def test_a_function_is_a_follower() -> None:
    run = touchline.simulate("study-square", seed=7, follower=pursue)
    assert run.success and run.errors()["lateral_max_m"] < 0.02
    assert run.hash != touchline.simulate("study-square", seed=7).hash


@pytest.mark.parametrize(
    ("follower", "words"),
    [
        (lambda state, ahead: (math.nan, 0.0), "gave a twist that is not finite"),
        (lambda state, ahead: 1 / 0, "fails with ZeroDivisionError"),
        (lambda state, ahead: (1.0,), "fails with ValueError"),
    ],
)
def test_a_follower_that_fails_stops_the_robot_and_ends_the_run(follower: object, words: str, tmp_path: Path) -> None:
    run = touchline.simulate("study-square", follower=follower, record=tmp_path / "failed.mcap")  # type: ignore[arg-type]
    assert not run.success and words in run.reason
    assert run.duration_s < 15.0
    frame = run.frame(kind="numpy")
    commands = [name for name in frame.dtype.names if name.startswith("command_")]
    assert all(np.isfinite(frame[name]).all() for name in commands)
    assert touchline.Recording(tmp_path / "failed.mcap").problem == ""


def test_what_cannot_be_is_refused_with_its_name() -> None:
    with pytest.raises(touchline.SpecError, match=r"follower.*mpc"):
        touchline.simulate("study-square", follower="mpcc")
    with pytest.raises(touchline.SpecError, match="asked over the bus"):
        touchline.simulate("study-square", follower="external")
    with pytest.raises(touchline.SpecError, match="give a name, a function"):
        touchline.simulate("study-square", follower=3)  # type: ignore[arg-type]
    with pytest.raises(touchline.SpecError, match="seed"):
        touchline.simulate("study-square", seed=-1)


def test_a_sweep_is_a_table_with_a_row_for_each_run() -> None:
    plan = touchline.plan("study-square")
    table = touchline.sweep(plan, seeds=2, settings={"follower": ["mpc", "pure-pursuit"]}, workers=1)
    assert len(table) == 4 and table.rows["success"].all()
    assert table.rows["follower"].tolist() == ["mpc", "mpc", "pure-pursuit", "pure-pursuit"]
    assert table.rows["lateral_error_mean_m"][0] == touchline.simulate(plan, seed=1).report.lateral_error_mean_m
    summary = table.summary()
    assert summary["runs"].tolist() == [2, 2] and summary["success"].tolist() == [1.0, 1.0]
    assert summary["success_low"][0] == pytest.approx(0.342, abs=1e-3)  # Wilson's interval for 2 of 2
    assert summary["lateral_error_mean_m_mean"][0] == pytest.approx(table.rows["lateral_error_mean_m"][:2].mean())
    assert "<table>" in table._repr_html_()


def test_a_drive_to_a_pose_and_a_team() -> None:
    there = touchline.goto((3.0, 1.0, 0.5), seed=2)
    assert there.success and there.off_m < 0.05 and abs(there.turned_rad) < 0.035
    with pytest.raises(touchline.SpecError, match="radians"):
        touchline.goto((3.0, 1.0, 180.0))
    with pytest.raises(touchline.SpecError, match="did you mean 'duration_s'"):
        touchline.goto((3.0, 1.0), duration=3.0)
    team = touchline.fleet(3, seed=4)
    assert team.names == ("tb1", "tb2", "tb3") and team.place_m.shape == (len(team.time_s), 3, 2)
    assert team.success == (team.reason == "")
