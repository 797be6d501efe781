"""A drive whose truth is known: outages, the smoothed track, other parameters, and odometry alone."""

import json
import math

import numpy as np
import pytest

from touchline.checking.estimating.estimate_figures import estimate_figures
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import run_estimator, run_inputs
from touchline.checking.estimating.log_figures import with_onboard
from touchline.checking.estimating.outages import outages
from touchline.checking.estimating.reference_frame import FrameFit
from touchline.checking.estimating.smoother import distance_in_sigma, smoothed
from touchline.checking.importing.import_logs import import_logs
from touchline.schemas.log_mapping import LogMapping

pytestmark = pytest.mark.xdist_group("withheld fixes")  # by one worker, so that the log is imported once

MAPPING = {"imu": {"stream": "odometry"}, "wheels": {"stream": "odometry"}, "reference": {"stream": "track"}}
FIXES = {"stream": "fixes", "taken_as": "fixed", "sigma_m": 0.01, "latency_s": 0.0}


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """100 s at 5 Hz of bends both ways; the gyro has noise, and for 20 s there are no fixes."""
    folder, rng = tmp_path_factory.mktemp("logs"), np.random.default_rng(3)
    time_s = np.arange(0.0, 100.0, 0.2)
    step = 0.2 * np.clip(0.5 * (time_s - 5.0), 0.0, 0.8)
    turn = np.where(time_s > 8.0, 0.06 * np.sin(time_s / 6.0), 0.0)
    heading = 1.0 + np.cumsum(turn) - turn
    east, north = (np.cumsum(step * part(heading + 0.5 * turn)) for part in (np.cos, np.sin))
    noise = rng.normal(0.0, 0.005, (2, len(time_s)))
    there = (time_s < 50.0) | (time_s > 70.0)
    read = turn + rng.normal(0.0, 0.002, len(time_s)) * (time_s > 5.0)
    for name, names, columns in (
        ("odometry", "time_s,distance_m,turn_rad", (time_s, step, read)),
        ("fixes", "time_s,east_m,north_m", (time_s[there], (east + noise[0])[there], (north + noise[1])[there])),
        ("track", "time_s,east_m,north_m,heading_rad", (time_s, east, north, heading + turn)),
    ):
        np.savetxt(folder / f"{name}.csv", np.column_stack(columns), "%.6f", ",", header=names, comments="")
    return folder


@pytest.fixture(scope="module")
def inputs(logs):
    out = logs / "session.mcap"
    paths = [logs / f"{name}.csv" for name in ("odometry", "fixes", "track")]
    import_logs(paths, LogMapping.model_validate({**MAPPING, "fixes": FIXES}), out)
    return EstimatorInputs(out, None)


def test_the_smoothed_track_is_nearer_to_the_truth_than_the_filter(inputs):
    run = run_inputs(inputs, inputs.setup)
    track, reference = smoothed(run, inputs.frames), run.reference
    there = np.column_stack([np.interp(track.ticks / 100, reference[:, 0], reference[:, axis]) for axis in (1, 2)])
    of_filter, of_smoother = (
        np.hypot(*(poses[:, :2] - there).T).mean() for poses in (run.poses[track.ticks], track.poses)
    )
    assert of_smoother < 0.9 * of_filter
    assert distance_in_sigma(run, track) < 1.5


def test_withheld_fixes_lie_within_their_sigma(inputs):
    found = {each.length_s: each for each in outages(inputs, inputs.setup)}
    assert len(found[10].error_m) >= 5
    assert found[10].inside_3_sigma_pct == 100.0
    assert np.median(found[30].sigma_m) > np.median(found[10].sigma_m) > 0.01


def test_an_overconfident_setup_is_seen_by_them(inputs, tmp_path):
    path = tmp_path / "onboard.json"
    path.write_text(json.dumps({"imu": {"gyro_density_radps_rthz": 1e-6}, "drive": {"side_slip_m_rtm": 0.0}}))
    sure = with_onboard(inputs.setup, path)
    assert sure.onboard.gnss == inputs.setup.onboard.gnss
    assert sure.onboard.drive.slip_relative == inputs.setup.onboard.drive.slip_relative
    honest, surer = (
        {each.length_s: float(np.median(each.sigma_m)) for each in outages(inputs, setup)}
        for setup in (inputs.setup, sure)
    )
    assert surer[30] < 0.7 * honest[30]


def test_a_log_without_fixes_runs_on_odometry_alone(logs):
    out = logs / "alone.mcap"
    done = import_logs([logs / "odometry.csv", logs / "track.csv"], LogMapping.model_validate(MAPPING), out)
    assert done.remarks == ["the log has no fixes: the estimator runs on odometry alone"]
    run = run_estimator(out)
    figures = estimate_figures(run, FrameFit.NONE)
    assert figures["verdict"] == []
    assert figures["error"]["points"] > 400
    assert math.hypot(*(run.poses[-1, :2] - run.reference[-1, 1:3])) < 2.0
