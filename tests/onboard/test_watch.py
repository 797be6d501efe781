"""Every single thing that speaks against painting, alone."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.services.onboard.interface import GnssSample

NOW_S = 20.0
TICK = 2000


def fix(**changes: Any) -> GnssSample:
    return GnssSample(NOW_S - 0.1, 0.0, 0.0, 1e-4, 3, 20, 1.0)._replace(**changes)


def looked(counters: dict[int, float] | None = None, **changes: Any) -> LocalizationMonitor:
    """A watch that has looked at an estimator with which all is well but for these."""
    values = np.zeros(m.COUNTERS)
    for index, value in (counters or {}).items():
        values[index] = value
    well = {
        "started": True,
        "contradicted": False,
        "last_fix": fix(),
        "last_used_stamp_s": NOW_S - 0.1,
        "position_sigma_m": 0.01,
        "heading_sigma_rad": 0.001,
        "intake": SimpleNamespace(imu_tick=TICK, encoder_tick=TICK),
    }
    estimator: Any = SimpleNamespace(counters=values, **{**well, **changes})
    watch = LocalizationMonitor(estimator)
    watch.look(TICK, NOW_S)
    return watch


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({}, ""),
        ({"started": False}, "not started"),
        ({"last_fix": fix(fix=2, variance_m2=1e-6)}, "a float fix"),
        ({"last_fix": fix(correction_age_s=10.5)}, "corrections are older"),
        ({"last_fix": fix(stamp_s=NOW_S - 0.6)}, "no fix for more than 0.5 s"),
        ({"last_used_stamp_s": NOW_S - 0.6}, "no fix has been usable"),
        ({"contradicted": True}, "contradict"),
        ({"counters": {m.NIS_FIX_RECENT: 4.5}}, "scatter"),
        ({"counters": {m.ENCODER_REJECTED_RECENT: 0.6}}, "wheels slip"),
        ({"position_sigma_m": 0.026}, "σ above 25 mm"),
        ({"heading_sigma_rad": math.radians(1.1)}, "heading is uncertain"),
        ({"intake": SimpleNamespace(imu_tick=TICK - 21, encoder_tick=TICK)}, "IMU's samples"),
        ({"intake": SimpleNamespace(imu_tick=TICK, encoder_tick=TICK - 21)}, "encoders' samples"),
    ],
)
def test_one_thing_alone_keeps_the_valve_closed(wrong: dict[str, Any], words: str) -> None:
    problem = looked(**wrong).paint_problem(0.0)
    assert words in problem and bool(words) == bool(problem)


def test_nothing_is_painted_beside_the_line() -> None:
    assert looked().paint_problem(-0.029) == ""
    assert "30 mm" in looked().paint_problem(-0.031)


def test_a_pose_is_good_again_only_after_a_second() -> None:
    watch = looked(position_sigma_m=0.1)
    watch._estimator.position_sigma_m = 0.01  # type: ignore[misc]
    for tick, settled in ((TICK + 10, False), (TICK + 99, False), (TICK + 100, True)):
        time_s = tick / 100
        watch._estimator.last_fix, watch._estimator.last_used_stamp_s = fix(stamp_s=time_s), time_s
        watch._estimator.intake.imu_tick = watch._estimator.intake.encoder_tick = tick
        watch.look(tick, time_s)
        assert watch.pose_problem == ""
        assert watch.settled(time_s) is settled


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({}, ""),
        ({"position_sigma_m": 0.1}, ""),  # not painting, but driving
        ({"position_sigma_m": 0.16}, "position is unknown"),
        ({"contradicted": True}, "contradict"),
        ({"intake": SimpleNamespace(imu_tick=TICK - 51, encoder_tick=TICK)}, "IMU's samples"),
        ({"intake": SimpleNamespace(imu_tick=TICK, encoder_tick=TICK - 51)}, "encoders' samples"),
        ({"intake": SimpleNamespace(imu_tick=TICK - 49, encoder_tick=TICK - 49)}, ""),
    ],
)
def test_what_stops_driving_too(wrong: dict[str, Any], words: str) -> None:
    problem = looked(**wrong).drive_problem()
    assert words in problem and bool(words) == bool(problem)
