"""Contacts of robots whose clocks differ are those of places at the same time, not at the same tick."""

from __future__ import annotations

import pytest

from benchmarks._true_drives import TrueDrives
from touchline.coordination.guidance_messages import header_at
from touchline.schemas.messages import Odometry, Point, Pose, PoseWithCovariance

LATE = 100


def odometry(tick: int, x_m: float) -> Odometry:
    pose = PoseWithCovariance(pose=Pose(position=Point(x=x_m, y=2.0)))
    return Odometry(header=header_at(tick), pose=pose)


@pytest.mark.parametrize(("in_step", "contacts"), [(True, 1), (False, 0)])
def test_a_robot_that_follows_another_a_second_later_does_not_touch_it(in_step: bool, contacts: int) -> None:
    drives = TrueDrives("ab", 9.0, in_step=in_step)
    for tick in range(LATE, 600):
        drives.take("a", odometry(tick, 1.0 + 0.005 * tick))
        drives.take("b", odometry(tick - LATE, 1.0 + 0.005 * (tick - LATE)))
    assert drives.contacts == (contacts, 0)
    assert drives.closest_m == pytest.approx(0.0 if in_step else 0.5, abs=0.01)
