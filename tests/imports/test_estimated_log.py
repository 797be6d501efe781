"""A table of a drive that is known, imported and estimated: the figures are right."""

import math

import numpy as np
import pytest

from touchline.checking.calibrating.drive_calibration import calibrate
from touchline.checking.check_session import check_recording
from touchline.checking.estimating.estimate_figures import estimate_figures
from touchline.checking.estimating.estimator_run import EstimatorRun, run_estimator
from touchline.checking.estimating.receiver_figures import receiver_figures
from touchline.checking.estimating.reference_frame import FrameFit
from touchline.checking.importing.import_logs import import_logs
from touchline.checking.reality.log_fit import fit_log
from touchline.schemas.errors import SpecError
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.setup import Setup

HEADING_RAD = 2.0


@pytest.fixture
def logs(tmp_path):
    """Half a minute at 5 Hz: 5 s of standing, then a slow curve; fixes with 5 mm of noise."""
    time_s = np.arange(0.0, 30.0, 0.2)
    speed = np.clip(0.5 * (time_s - 5.0), 0.0, 0.6)
    turn = np.where(time_s > 8.0, 0.02, 0.0)
    heading = HEADING_RAD + np.cumsum(turn) - turn
    step = speed * 0.2
    east, north = (np.cumsum(step * part(heading + 0.5 * turn)) for part in (np.cos, np.sin))
    noise = np.random.default_rng(1).normal(0.0, 0.005, (2, len(time_s)))
    odometry, fixes, track = (tmp_path / f"{name}.csv" for name in ("odometry", "fixes", "track"))
    for path, names, columns in (
        (odometry, "time_s,distance_m,turn_rad", (time_s, step, turn)),
        (fixes, "time_s,east_m,north_m", (time_s, east + noise[0], north + noise[1])),
        (track, "time_s,east_m,north_m", (time_s, east + 3.0, north - 2.0)),
    ):
        np.savetxt(path, np.column_stack(columns), "%.6f", ",", header=names, comments="")
    return [odometry, fixes, track]


MAPPING = {
    "fixes": {"stream": "fixes", "taken_as": "fixed", "sigma_m": 0.01, "latency_s": 0.0},
    "imu": {"stream": "odometry"},
    "wheels": {"stream": "odometry"},
    "reference": {"stream": "track"},
}


def test_the_estimate_follows_a_known_drive(logs, tmp_path):
    out = tmp_path / "session.mcap"
    done = import_logs(logs, LogMapping.model_validate(MAPPING), out)
    assert done.remarks == []
    figures = estimate_figures(run_estimator(out), FrameFit.SHIFT)
    assert figures["fixes"]["accepted_pct"] == 100.0
    assert figures["verdict"] == []
    assert figures["error"]["p95_m"] < 0.03
    plain = estimate_figures(run_estimator(out), FrameFit.NONE)
    assert plain["error"]["mean_m"] == pytest.approx(math.hypot(3.0, 2.0), abs=0.03)


def test_a_receiver_that_stood_tells_how_it_wanders_also_if_it_moved_in_the_end():
    """Fixes of 5 mm that are forgotten within 30 s, then a drive."""
    noise, share = np.random.default_rng(2).normal(0.0, 1.0, (2000, 2)), math.exp(-1.0 / 30.0)
    off = np.zeros((2000, 2))
    for i in range(1, 2000):
        off[i] = share * off[i - 1] + math.sqrt(1.0 - share**2) * 0.005 * noise[i]
    rows = np.column_stack([np.arange(2000.0), off, np.full(2000, 0.01), np.full(2000, 3.0), np.zeros(2000)])
    rows[1900:, 1] += np.arange(100.0)
    figures = receiver_figures(EstimatorRun(Setup(), "r1", receiver=rows))
    assert figures["fixes"] == 1901
    assert figures["sigma_east_m"] == pytest.approx(0.005, rel=0.2)
    assert figures["step_1s_m"] == pytest.approx(0.005 * math.sqrt(2.0 * (1.0 - share)), rel=0.1)
    assert figures["autocorrelation_60s"] == pytest.approx(math.exp(-2.0), abs=0.15)
    rows[:, 1] = np.arange(2000.0)
    assert receiver_figures(EstimatorRun(Setup(), "r1", receiver=rows)) is None


def test_a_jump_of_the_receiver_is_accepted_if_the_configuration_says_so(logs, tmp_path):
    fixes = np.loadtxt(logs[1], delimiter=",", skiprows=1)
    fixes[fixes[:, 0] >= 20.0, 1:] += 1.5, -0.8
    np.savetxt(logs[1], fixes, "%.6f", ",", header="time_s,east_m,north_m", comments="")
    found = {}
    for name, asked in (("nobody", {"gnss": {"jump_fixes": 10}}), ("operator", {})):
        out = tmp_path / f"{name}.mcap"
        import_logs(logs, LogMapping.model_validate({**MAPPING, "onboard": asked}), out)
        found[name] = estimate_figures(run_estimator(out), FrameFit.SHIFT)
    assert found["nobody"]["jumps"]["accepted"] == 1
    assert found["nobody"]["jumps"]["largest_m"] == pytest.approx(1.7, abs=0.1)
    assert found["nobody"]["fixes"]["rejected"] == pytest.approx(10, abs=3)
    assert found["nobody"]["verdict"] == []
    assert found["operator"]["jumps"]["accepted"] == 0
    assert "outside of its design" in found["operator"]["verdict"][0]


def test_the_estimator_alone_cannot_be_compared_with_what_was_never_estimated(logs, tmp_path):
    out = tmp_path / "session.mcap"
    import_logs(logs, LogMapping.model_validate(MAPPING), out)
    (found,) = check_recording(out, only="estimator")
    assert not found.passed
    assert "`touchline estimate` runs the estimator on it" in found.problem


def test_what_does_not_fit_the_log_names_field_and_remedy(logs, tmp_path):
    mapping = LogMapping.model_validate({"fixes": {"stream": "fixes", "columns": {"east_m": "x"}}})
    with pytest.raises(SpecError, match=r"fixes.columns.east_m is 'x', which fixes does not have; its columns are"):
        import_logs(logs, mapping, tmp_path / "session.mcap")
    with pytest.raises(SpecError, match=r"imu.stream is 'imu'; name a stream of the log"):
        import_logs(logs, LogMapping.model_validate({"imu": {"stream": "imu"}}), tmp_path / "session.mcap")


def test_the_heading_is_told_wherever_the_estimator_starts(logs, tmp_path):
    """The wheels turn a little after 0.4 s, so that the robot stands for half a second only later."""
    table = np.genfromtxt(logs[0], delimiter=",", names=True)
    table["distance_m"][3:5] = 0.002, -0.002
    np.savetxt(logs[0], table, "%.6f", ",", header="time_s,distance_m,turn_rad", comments="")
    out = tmp_path / "session.mcap"
    import_logs(logs, LogMapping.model_validate(MAPPING), out)
    run = run_estimator(out)
    assert run.starts_s[0] < 0.5
    started = run.poses[np.isfinite(run.poses).all(axis=1)]
    assert started[0, 2] == pytest.approx(HEADING_RAD, abs=0.05)
    assert estimate_figures(run, FrameFit.SHIFT)["error"]["p95_m"] < 0.03


def test_wheels_and_fixes_alone_are_estimated(logs, tmp_path):
    out = tmp_path / "session.mcap"
    import_logs(logs, LogMapping.model_validate({**MAPPING, "imu": None}), out)
    figures = estimate_figures(run_estimator(out), FrameFit.SHIFT)
    assert figures["fixes"]["accepted_pct"] == 100.0
    assert figures["error"]["p95_m"] < 0.03


def test_a_log_without_a_start_says_why(logs, tmp_path):
    out = tmp_path / "session.mcap"
    done = import_logs(logs, LogMapping.model_validate({**MAPPING, "heading": {"course_m": 500.0}}), out)
    assert "by its wheels the robot never gets 500 m away" in done.remarks[0]
    (problem,) = estimate_figures(run_estimator(out), FrameFit.SHIFT)["verdict"]
    assert "by its wheels the robot never gets 500 m away" in problem


def test_a_log_without_rtk_is_not_calibrated_for_that_reason(logs, tmp_path):
    out = tmp_path / "session.mcap"
    fixes = {**MAPPING["fixes"], "taken_as": "float"}
    import_logs(logs, LogMapping.model_validate({**MAPPING, "fixes": fixes}), out)
    for tried in (calibrate, fit_log):
        with pytest.raises(SpecError, match="no start: none of the fixes is RTK-fixed"):
            tried(out, None)
