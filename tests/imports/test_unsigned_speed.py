"""Log of a robot that reverses and whose speed has no sign: the course of the fixes tells it, and mends it."""

import math

import numpy as np
import pytest

from touchline.checking.calibrating.drive_calibration import calibrate
from touchline.checking.estimating.estimate_figures import verdict
from touchline.checking.estimating.estimator_run import run_estimator
from touchline.checking.importing.import_logs import import_logs
from touchline.checking.reality.log_fit import fit_log
from touchline.recordings.logs.reversals import reversals
from touchline.schemas.errors import SpecError
from touchline.schemas.log_mapping import LogMapping

STREAMS = {
    "fixes": {"stream": "log", "taken_as": "fixed", "sigma_m": 0.01, "latency_s": 0.0},
    "imu": {"stream": "log"},
    "wheels": {"stream": "log"},
}
BACKWARD = (35.0, 45.0)
BIAS_RADPS = 0.02


def drive(*, bias_radps=BIAS_RADPS):
    """Time, speed, yaw rate, east, north: rest, a bend, from 35 to 45 s backward through it, a bend; a gyro's bias."""
    time_s = np.arange(0.0, 70.0, 0.1)
    speed = 0.8 * (np.minimum(np.clip(time_s - 5.0, 0.0, 1.0), np.clip(70.0 - time_s, 0.0, 1.0)))
    for begin_s in BACKWARD:
        speed *= np.clip(np.abs(time_s - begin_s), 0.0, 1.0)
    speed[(time_s > BACKWARD[0]) & (time_s < BACKWARD[1])] *= -1.0
    turn = np.where(time_s > 15.0, 0.1, 0.0) * np.abs(speed)
    heading = 1.0 + 0.1 * np.cumsum(turn)
    east, north = (0.1 * np.cumsum(speed * part(heading)) for part in (np.cos, np.sin))
    return time_s, speed, turn + bias_radps, east, north


def found(speed, time_s, turn, east, north):
    noise = np.random.default_rng(1).normal(0.0, 0.007, (2, len(time_s)))
    fixes = np.column_stack([time_s, east + noise[0], north + noise[1], np.full(len(time_s), 0.01)])
    return reversals(time_s, 0.1 * np.cumsum(speed), turn, fixes)


def test_the_course_of_the_fixes_tells_where_a_speed_lacks_its_sign():
    time_s, speed, turn, east, north = drive()
    (span,) = found(np.abs(speed), time_s, turn, east, north)
    assert span == pytest.approx(BACKWARD, abs=0.2)
    assert found(speed, time_s, turn, east, north) == ()


def test_a_drive_that_begins_backward_has_an_open_span():
    time_s, speed, turn, east, north = drive()
    later = time_s > 40.0
    columns = (np.abs(speed)[later], time_s[later], turn[later], east[later], north[later])
    (span,) = found(*columns)
    assert span == pytest.approx((-math.inf, BACKWARD[1]), abs=0.2)


def test_nothing_is_told_of_a_gyro_that_does_not_fit_the_track_or_is_missing():
    time_s, speed, turn, east, north = drive()
    assert found(np.abs(speed), time_s, -turn * 8.0, east, north) == ()
    missing = np.where(np.arange(len(turn)) % 50 < 30, np.nan, turn)
    assert found(np.abs(speed), time_s, missing, east, north) == ()


@pytest.fixture
def log(tmp_path):
    time_s, speed, turn, east, north = drive(bias_radps=0.0)
    noise = np.random.default_rng(1).normal(0.0, 0.005, (2, len(time_s)))
    columns = np.column_stack([time_s, np.abs(speed), turn, east + noise[0], north + noise[1]])
    names = "time_s,speed_mps,yaw_rate_radps,east_m,north_m"
    np.savetxt(tmp_path / "log.csv", columns, "%.6f", ",", header=names, comments="")
    return tmp_path / "log.csv"


def test_estimate_says_so_with_the_remedy_and_nothing_is_calibrated_or_fitted(log, tmp_path):
    session = tmp_path / "session.mcap"
    import_logs([log], LogMapping.model_validate(STREAMS), session)
    (said,) = [line for line in verdict(run_estimator(session)) if line.startswith("not consistent")]
    assert "from 35.0 to 45.0 s the course of the fixes is opposite to the heading" in said
    assert '"unsigned": true' in said
    for tried in (calibrate, fit_log):
        with pytest.raises(SpecError, match=r"has a speed without a sign: from 35\.0 to 45\.0 s"):
            tried(session, None)


def test_with_the_remedy_the_log_is_consistent(log, tmp_path):
    session = tmp_path / "session.mcap"
    wheels = {**STREAMS["wheels"], "unsigned": True}
    done = import_logs([log], LogMapping.model_validate({**STREAMS, "wheels": wheels}), session)
    assert "wheels: taken to turn backward from 35.0 to 45.0 s, by the course of the fixes" in done.remarks
    run = run_estimator(session)
    assert run.reversals == ()
    assert verdict(run) == []
