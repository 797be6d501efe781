"""The robot's computer with a rear-steered drive."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.onboard import filter_model as m
from touchline.onboard import tracking_state as tracking
from touchline.onboard.control import MpcFollower
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import TICK_S
from touchline.onboard.trajectory.path_projection import A_SPEED, AHEAD_COLUMNS
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles.shipped import CLAY_ROLLER

pytestmark = pytest.mark.xdist_group("roller")  # its kernels are compiled in one worker

DRIVE, DATA = drive_of(CLAY_ROLLER, 0.002), CLAY_ROLLER.drive
BASE_M, RADIUS_M = DATA.wheelbase_m, DATA.drum_radius_m
OWN = (m.SPEED, m.YAW_RATE, m.ODOMETRY_ERROR, m.ODOMETRY_ERROR + 1)

speeds = st.floats(0.1, 1.0) | st.floats(-1.0, -0.1)
angles = st.floats(-0.5, 0.5)
offsets = st.floats(-0.05, 0.05)


def now(*, speed_mps: float = 0.0, slip: float = 0.0, offset: float = 0.0, steering: float = 0.0) -> np.ndarray:
    place, x = np.zeros(tracking.COMMAND + 2), np.zeros(m.STATES)
    x[m.ODOMETRY_ERROR], x[m.ODOMETRY_ERROR + 1] = slip, offset
    onboard_drive.effective(DRIVE.figures, x, place)
    place[tracking.SPEED], place[tracking.COMMAND + 1] = speed_mps, steering
    place[tracking.REFERENCE_SPEED] = speed_mps
    return place


@given(speeds, angles, st.floats(-0.04, 0.04), offsets)
def test_odometry_of_what_is_true_leaves_no_innovation(v: float, angle: float, slip: float, offset: float) -> None:
    x, z, h = np.zeros(m.STATES), m.TickInputs(), np.zeros((2, m.STATES))
    x[list(OWN)] = v, -v * math.tan(angle + offset) / BASE_M, slip, offset
    z.odometry[0], z.odometry[1] = v / (1.0 - slip), angle
    z.smooth[0] = z.odometry[0]
    y0, y1, variance = onboard_drive.odometry(DRIVE.figures, x, z.array[0], h)
    assert (y0, y1) == pytest.approx((0.0, 0.0), abs=1e-12) and variance > 0.0
    for state in OWN:
        ahead, behind = (x + sign * 1e-4 * np.eye(m.STATES)[state] for sign in (1.0, -1.0))
        over, under = (
            np.array(onboard_drive.odometry(DRIVE.figures, near, z.array[0], np.zeros((2, m.STATES)))[:2])
            for near in (ahead, behind)
        )
        assert (under - over) / 2e-4 == pytest.approx(h[:, state], abs=1e-6), "the Jacobian is the derivative"


@given(speeds, angles, st.floats(-0.04, 0.04), offsets)
def test_actuators_and_twist_are_each_others_inverse(v: float, angle: float, slip: float, offset: float) -> None:
    place = now(speed_mps=v, slip=slip, offset=offset, steering=angle)
    yaw_rate = -v * math.tan(angle + offset) / BASE_M
    drum, steering = onboard_drive.actuators_of(DRIVE.figures, v, yaw_rate, place)
    assert drum == pytest.approx(v / (RADIUS_M * (1.0 - slip)))
    assert steering == pytest.approx(angle, abs=1e-12)
    assert onboard_drive.twist(DRIVE.figures, np.array([drum, steering]), place) == pytest.approx((v, yaw_rate))
    for actuator, step in enumerate((1e-6, 1e-6)):
        moved = np.array([drum, steering])
        moved[actuator] += step
        changed = np.array(onboard_drive.twist(DRIVE.figures, moved, place)) - (v, yaw_rate)
        assert changed / step == pytest.approx(onboard_drive.gain(DRIVE.figures, actuator, place), abs=1e-4)


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.57, 0.57))
def test_commands_keep_the_limits(v: float, w: float, speed_mps: float, held: float) -> None:
    commands = np.zeros(2)
    onboard_drive.command(DRIVE.figures, v, w, now(speed_mps=speed_mps, steering=held), commands)
    assert abs(commands[0]) <= DATA.max_drum_speed_radps
    assert abs(commands[0] - speed_mps / RADIUS_M) <= DRIVE.reach[0] + 1e-9
    assert abs(commands[1]) <= DATA.steering_stop_rad
    assert abs(commands[1] - held) <= DATA.steering_rate_limit_radps * TICK_S + 1e-12


def test_at_standstill_the_steering_is_held() -> None:
    commands = np.zeros(2)
    onboard_drive.command(DRIVE.figures, 0.01, 0.02, now(steering=0.3), commands)
    assert commands[1] == 0.3
    assert DRIVE.resting((1.0, 0.3)) == (0.0, 0.3)


def test_what_it_cannot_drive_is_refused() -> None:
    DRIVE.check_curvature("it", -math.tan(0.5) / BASE_M)
    DRIVE.check_speeds(np.array([1.0]), np.array([0.27]), str)
    with pytest.raises(CommandRefused, match=r"it has a radius of 3\.000 m, which needs a steering angle of 0\.588"):
        DRIVE.check_curvature("it", 1.0 / 3.0)
    with pytest.raises(CommandRefused, match=r"second: 1\.10 m/s, the limit is 1\.00 m/s"):
        DRIVE.check_speeds(np.array([1.0, 1.1]), np.zeros(2), ("first", "second").__getitem__)
    with pytest.raises(CommandRefused, match="it: a rear-steered vehicle cannot turn on the spot"):
        DRIVE.check_spin("it", 0.1)


@pytest.mark.parametrize("sense", [1.0, -1.0], ids=["forward", "backward"])
@pytest.mark.parametrize("error_rad", [-0.08, 0.08])
def test_mpc_sets_off_from_a_cusp_in_the_direction_of_the_leg(error_rad: float, sense: float) -> None:
    """Turned off its path, still rolling the other way, and steered so that driving on would turn it farther off."""
    follower, place = MpcFollower(CLAY_ROLLER), now(slip=0.02)
    ahead = np.zeros((follower.ahead_rows, AHEAD_COLUMNS))
    ahead[:, A_SPEED] = sense * np.minimum(0.05 + 0.1 * TICK_S * np.arange(follower.ahead_rows), 1.0)
    speed_mps, steering_rad, yaw_error_rad = -0.1 * sense, -0.3 * sense * np.sign(error_rad), error_rad
    commands = list[float]()
    for _ in range(300):
        place[tracking.HEADING_ERROR], place[tracking.SPEED] = yaw_error_rad, speed_mps
        place[tracking.REFERENCE_SPEED] = ahead[0, A_SPEED]
        place[tracking.COMMAND + 1] = steering_rad
        _, _, actuators = follower.step(place, ahead)
        assert actuators is not None
        commands.append(sense * actuators[0])
        place[tracking.COMMAND] = actuators[0]
        steering_rad += np.clip(actuators[1] - steering_rad, -1.0, 1.0) * TICK_S / DATA.steering_time_constant_s
        speed_mps += (actuators[0] * place[tracking.EFFECT] - speed_mps) * TICK_S / DATA.drum_time_constant_s
        yaw_error_rad -= speed_mps * math.tan(steering_rad) / BASE_M * TICK_S
    assert min(commands) > -1e-9 and follower.fallbacks == 0
    assert abs(yaw_error_rad) < abs(error_rad) and sense * speed_mps > 0.04
