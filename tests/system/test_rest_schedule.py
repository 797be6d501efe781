"""Rests of a robot under way: when it is let on."""

import math

from touchline.jobs.calibration.rest_schedule import RestSchedule
from touchline.services.planner.calibration_drive import PlannedRest


def test_a_robot_is_let_on_once_it_has_stood_at_the_place_for_long_enough():
    schedule = RestSchedule([PlannedRest(0.0, 5.0), PlannedRest(2.0, 2.0)])
    assert schedule.until_m == 0.0
    assert not schedule.look(1.0, 0.0, 0.0, 0.0)
    assert not schedule.look(5.9, 0.0, 0.0, 0.0)
    assert schedule.look(6.0, 0.0, 0.0, 0.0)
    assert schedule.until_m == 2.0
    assert not schedule.look(9.0, 1.0, 0.0, 0.0)  # stopped by something else
    assert not schedule.look(12.0, 2.0, 0.0, 0.5)  # turns on the spot
    assert not schedule.look(13.0, 1.995, 0.0, 0.0)
    assert not schedule.look(14.0, 1.995, 0.1, 0.0)  # time counts anew
    assert not schedule.look(15.5, 1.995, 0.0, 0.0)
    assert schedule.look(17.5, 1.995, 0.0, 0.0)
    assert schedule.until_m == math.inf
    assert not schedule.look(30.0, 4.0, 0.0, 0.0)
