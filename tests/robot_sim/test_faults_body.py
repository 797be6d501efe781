"""Faults of the body and its actuators: what they do to the robot, and that they end."""

import pytest

from tests.robot_sim.open_loop import drive, fault, second
from touchline.onboard.interface import Command


def test_a_blocked_wheel_stands_and_turns_the_robot():
    run = drive(400, second("wheel-blocked", actuator="left"), noise="none")
    assert run[99].state.yaw_rate_radps == pytest.approx(0.0, abs=1e-6)
    assert {float(tick.drive.rate_radps[0]) for tick in run[100:200]} == {0.0}
    assert run[199].state.heading_rad > 0.5
    assert run[199].frame.encoders[0] == run[100].frame.encoders[0]
    assert run[-1].drive.rate_radps[0] == pytest.approx(10.0, abs=0.2)
    assert run[-1].state.yaw_rate_radps == pytest.approx(0.0, abs=0.02)


def test_a_slipping_wheel_turns_without_getting_on():
    run = drive(400, second("wheel-slip", share=0.5), noise="none")
    assert run[199].drive.rate_radps[0] == pytest.approx(10.0, abs=0.2)
    assert run[199].state.speed_mps == pytest.approx(0.5, abs=0.05)
    assert run[-1].state.speed_mps == pytest.approx(run[99].state.speed_mps, abs=0.02)


def test_a_weak_motor_cannot_keep_up():
    hill = {"grade": 0.15, "uphill_rad": 0.0}
    run = drive(500, second("motor-weak", actuator="all", share=0.02), noise="none", ground=hill)
    assert run[99].drive.rate_radps[0] == pytest.approx(10.0, abs=0.2)
    assert run[199].drive.rate_radps[0] < 5.0
    assert run[-1].drive.rate_radps[0] == pytest.approx(10.0, abs=0.3)


def test_a_valve_stuck_open_sprays_whatever_is_commanded():
    run = drive(300, second("valve-stuck", position="open"), command=Command((10.0, 10.0), False, False))
    assert [tick.sprayed for tick in run] == [False] * 100 + [True] * 103 + [False] * 97  # closes in 30 ms
    assert run[150].state.valve_open


def test_a_valve_stuck_closed_sprays_nothing():
    run = drive(300, second("valve-stuck", position="closed"))
    sprayed = [tick.sprayed for tick in run]
    assert all(sprayed[2:100]) and not any(sprayed[101:200]) and all(sprayed[202:])
    assert run[199].state.tank_l == run[101].state.tank_l


def test_stuck_discs_stay():
    run = drive(300, second("disc-stuck", position="up"))
    assert [run[tick].state.disc_down for tick in (99, 100, 199, 240, 251)] == [True, False, False, False, True]


def test_the_bumper_is_pressed_and_nobody_is_heard():
    run = drive(300, second("bumper"), second("operator-lost"))
    assert [tick.frame.bumper for tick in run] == [False] * 100 + [True] * 100 + [False] * 100
    assert [tick.frame.operator_alive for tick in run] == [True] * 100 + [False] * 100 + [True] * 100


def test_a_low_battery_is_reported_and_replaced():
    run = drive(300, second("battery-low", fraction=0.1))
    charge = [tick.frame.battery_fraction for tick in run]
    assert charge[99] > 0.999 and charge[100] == pytest.approx(0.1, abs=1e-4) and charge[199] < 0.1
    assert charge[200] > 0.998
    assert charge == sorted(charge[:100], reverse=True) + sorted(charge[100:200], reverse=True) + charge[200:]


def test_an_empty_battery_stops_the_robot():
    run = drive(700, fault("battery-low", fraction=0.0, start_s=1.0, duration_s=4.0), noise="none")
    assert run[99].state.speed_mps > 0.9
    assert run[499].state.speed_mps < 0.3
    assert run[-1].state.speed_mps > 0.9


def test_an_empty_tank_paints_nothing_until_it_is_refilled():
    run = drive(300, second("tank-empty"))
    assert [run[tick].frame.tank_l for tick in (100, 199)] == [0.0, 0.0]
    assert not any(tick.sprayed for tick in run[100:200])
    assert all(tick.sprayed for tick in run[200:])
    assert run[200].frame.tank_l == pytest.approx(run[99].frame.tank_l, abs=1e-3)
