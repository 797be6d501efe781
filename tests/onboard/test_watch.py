"""Every single thing that speaks against painting, alone."""

from __future__ import annotations

import math
from typing import Any

import pytest

from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.interface import GnssSample

NOW_S = 20.0
TICK = 2000


def fix(**changes: Any) -> GnssSample:
    return GnssSample(NOW_S - 0.1, 0.0, 0.0, 1e-4, 3, 20, 1.0)._replace(**changes)


class Watch:
    """A monitor of a computer with whose estimate all is well, but for these."""

    def __init__(self, **wrong: Any) -> None:
        self.computer = ComputerState.sized(2)()
        self.monitor = LocalizationMonitor(self.computer)
        well = {"first_tick": 100, "last_used_stamp_s": NOW_S - 0.1, "fix": fix(), "position_sigma_m": 0.01}
        self.look(TICK, **{**well, "heading_sigma_rad": 0.001, "imu_tick": TICK, "encoder_tick": TICK, **wrong})

    def look(self, tick: int, **changes: Any) -> None:
        """Let a tick be evaluated after these changes."""
        c = self.computer
        c.times.tick = tick
        P = c.filter.covariances[tick % m.RING]
        for name, value in changes.items():
            if name == "position_sigma_m":
                c.filter.covariances[:, m.EAST, m.EAST] = c.filter.covariances[:, m.NORTH, m.NORTH] = value**2
            elif name == "heading_sigma_rad":
                P[m.HEADING, m.HEADING] = value**2
            elif name == "counters":
                c.filter.counters.reset(**value)
            elif name == "fix":
                c.times.fix.reset(**value._asdict())
                c.times.has_fix = True
            else:
                setattr(c.buffer if name in ("imu_tick", "encoder_tick") else c.times, name, value)
        self.monitor.look(tick)


def looked(**wrong: Any) -> LocalizationMonitor:
    return Watch(**wrong).monitor


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({}, ""),
        ({"first_tick": -1}, "not started"),
        ({"fix": fix(fix=2, variance_m2=1e-6)}, "a float fix"),
        ({"fix": fix(correction_age_s=10.5)}, "corrections are older"),
        ({"fix": fix(stamp_s=NOW_S - 0.6)}, "no fix for more than 0.5 s"),
        ({"last_used_stamp_s": NOW_S - 0.6}, "no fix has been usable"),
        ({"counters": {"fix_doubt": CONTRADICTED}}, "contradict"),
        ({"counters": {"fix_nis_recent": 4.5}}, "scatter"),
        ({"counters": {"encoders_rejected_recent": 0.6}}, "wheels slip"),
        ({"position_sigma_m": 0.026}, "σ above 25 mm"),
        ({"heading_sigma_rad": math.radians(1.1)}, "heading is uncertain"),
        ({"imu_tick": TICK - 21}, "IMU's samples"),
        ({"encoder_tick": TICK - 21}, "encoders' samples"),
    ],
)
def test_one_thing_alone_keeps_the_valve_closed(wrong: dict[str, Any], words: str) -> None:
    problem = looked(**wrong).paint_problem(0.0)
    assert words in problem and bool(words) == bool(problem)


def test_nothing_is_painted_beside_the_line() -> None:
    assert looked().paint_problem(-0.029) == ""
    assert "30 mm" in looked().paint_problem(-0.031)


def test_a_pose_is_good_again_only_after_a_second() -> None:
    watch = Watch(position_sigma_m=0.1)
    for tick, settled in ((TICK + 10, False), (TICK + 99, False), (TICK + 100, True)):
        time_s = tick / 100
        newest = {"fix": fix(stamp_s=time_s), "last_used_stamp_s": time_s, "imu_tick": tick, "encoder_tick": tick}
        watch.look(tick, position_sigma_m=0.01, **newest)
        assert watch.monitor.pose_problem == ""
        assert watch.monitor.settled(time_s) is settled


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({}, ""),
        ({"position_sigma_m": 0.1}, ""),  # not painting, but driving
        ({"position_sigma_m": 0.16}, "position is unknown"),
        ({"counters": {"fix_doubt": CONTRADICTED}}, "contradict"),
        ({"imu_tick": TICK - 51}, "IMU's samples"),
        ({"encoder_tick": TICK - 51}, "encoders' samples"),
        ({"imu_tick": TICK - 49, "encoder_tick": TICK - 49}, ""),
    ],
)
def test_what_stops_driving_too(wrong: dict[str, Any], words: str) -> None:
    problem = looked(**wrong).drive_problem()
    assert words in problem and bool(words) == bool(problem)
