"""Both followers on perfect and noisy robots: lines, arcs, clothoids; limits; what happens when the solver fails."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.onboard.rig import Run, chain, clothoid, start, trajectory
from tests.with_full import with_full
from touchline.onboard import tracking_state as tracking
from touchline.onboard.control import MpcFollower, make_follower, mpc
from touchline.onboard.trajectory import path_projection as projection
from touchline.schemas.curves import PathTable
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.vehicles import Vehicle

FOLLOWERS = ["mpc", "pure-pursuit"]
VEHICLE = Vehicle()

SPIRAL = 0.5
COURSES = {
    "line": chain((0.0, 12.0)),
    "circle": chain((0.0, 5.0), *clothoid(0.6, SPIRAL, 6), (0.6, 6.0), *clothoid(0.6, SPIRAL, 6)[::-1], (0.0, 3.0)),
    "right turn": chain((0.0, 5.0), *clothoid(-1.0, 0.8, 8), (-1.0, 1.0), *clothoid(-1.0, 0.8, 8)[::-1], (0.0, 3.0)),
    "slalom": chain(
        (0.0, 5.0),
        *(
            piece
            for side in (0.8, -0.8, 0.8)
            for piece in [*clothoid(side, SPIRAL, 5), (side, 1.0), *clothoid(side, SPIRAL, 5)[::-1]]
        ),
        (0.0, 3.0),
    ),
}


def offsets(run: Run, curves: list, from_m: float = 0.0, to_m: float = math.inf) -> np.ndarray:
    """True distances of the axle from the path while driving it."""
    table = PathTable.from_curves(curves)
    found = []
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
        arc = run.onboard.status.arc_length_m
        if from_m < arc < to_m:
            x, y, heading, _ = table.at(arc)
            found.append((run.rig.y - y) * math.cos(heading) - (run.rig.x - x) * math.sin(heading))
    return np.abs(np.array(found))


@pytest.mark.parametrize("follower", FOLLOWERS)
@pytest.mark.parametrize("course", with_full("slalom", full=("line", "circle", "right turn")))
def test_perfect_robot_stays_within_a_millimetre_and_a_half(follower: str, course: str) -> None:
    run = start(trajectory(COURSES[course]), follower)
    off = offsets(run, COURSES[course])
    assert run.onboard.state == TraversalStatus.DONE
    assert off.max() < 1.5e-3
    assert run.onboard.status.follower_fallbacks == 0


@pytest.mark.parametrize("follower", FOLLOWERS)
def test_noisy_robot_stays_within_two_centimetres(follower: str) -> None:
    worst = []
    for seed in range(2):
        run = start(trajectory(COURSES["slalom"]), follower, "default", seed)
        run.rig.heading += 0.05
        run.rig.y += 0.1
        worst.append(np.percentile(offsets(run, COURSES["slalom"], from_m=5.0), 95))
        assert run.onboard.state == TraversalStatus.DONE
    assert max(worst) < 0.025
    assert np.mean(worst) < 0.02


@pytest.mark.parametrize("follower", FOLLOWERS)
def test_speed_follows_the_profile(follower: str) -> None:
    curves = chain((0.0, 10.0))
    speeds = [(0.0, 0.0), (0.5, 1.0), (4.0, 1.0), (5.0, 0.5), (9.9, 0.5), (10.0, 0.0)]
    run = start(trajectory(curves, speeds=speeds), follower)
    seen = {}
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
        seen[round(run.onboard.status.arc_length_m, 1)] = run.rig.speed
    assert seen[3.0] == pytest.approx(1.0, abs=0.01)
    assert seen[4.5] == pytest.approx(math.sqrt(0.625), abs=0.03)
    assert seen[8.0] == pytest.approx(0.5, abs=0.01)
    assert abs(run.onboard.status.arc_length_m - 10.0) < 0.02


def test_the_solver_keeps_the_wheels_limits_even_from_a_bad_start() -> None:
    run = start(trajectory(COURSES["slalom"], speed=1.0), "mpc")
    run.rig.heading += 0.5
    run.rig.y += 0.6
    reach = VEHICLE.drive.max_wheel_acceleration_radps2 * VEHICLE.drive.motor_time_constant_s
    for _ in range(1500):
        command = run.tick()
        assert max(abs(command.actuators[0]), abs(command.actuators[1])) <= VEHICLE.drive.max_wheel_speed_radps + 1e-9
        for turning, wanted in zip(run.rig.wheels, command.actuators, strict=True):
            assert abs(wanted - turning) <= reach + 0.6, command
    assert abs(run.onboard.lateral_error_m) < 0.01


def standing_inputs() -> tuple[np.ndarray, np.ndarray]:
    now = np.zeros(tracking.COMMAND + 2)
    now[tracking.EFFECT] = now[tracking.EFFECT + 1] = VEHICLE.drive.wheel_radius_m
    now[tracking.SPEED] = now[tracking.REFERENCE_SPEED] = 1.0
    now[tracking.COMMAND] = now[tracking.COMMAND + 1] = 10.0
    ahead = np.zeros((100, projection.AHEAD_COLUMNS))
    ahead[:, projection.A_SPEED] = 1.0
    return now, ahead


@pytest.mark.parametrize("name", FOLLOWERS)
def test_on_the_path_at_speed_nothing_changes(name: str) -> None:
    now, ahead = standing_inputs()
    assert make_follower(name, VEHICLE).step(now, ahead)[:2] == pytest.approx((1.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("name", FOLLOWERS)
@pytest.mark.parametrize("sense", [1, -1])
def test_steers_back_to_the_path_forward_and_backward(name: str, sense: int) -> None:
    now, ahead = standing_inputs()
    now[tracking.LATERAL] = now[tracking.NOZZLE_LATERAL] = 0.02
    for index in (
        tracking.SPEED,
        tracking.REFERENCE_SPEED,
        tracking.COMMAND,
        tracking.COMMAND + 1,
    ):
        now[index] *= sense
    ahead *= sense
    yaw_rate_radps = make_follower(name, VEHICLE).step(now, ahead).yaw_rate_radps
    # Left of the path: forward turn right; backward turn left, so that the tail swings to the path.
    assert yaw_rate_radps * sense < -0.02


def test_at_its_iteration_cap_the_solver_gives_up_and_pure_pursuit_drives_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """From here the wheels' limits bind for a while, which takes more than two iterations, but not sixty."""
    curves = chain((0.0, 8.0))

    def from_beside() -> tuple[Run, float]:
        run = start(trajectory(curves), "mpc")
        run.rig.heading += 0.2
        run.rig.y += 0.2
        off = offsets(run, curves, from_m=6.0)
        assert run.onboard.state == TraversalStatus.DONE
        return run, float(off.max())

    unbound, _ = from_beside()
    assert unbound.onboard.status.follower_fallbacks == 0
    monkeypatch.setattr(mpc, "ITERATION_CAP", 2)
    capped, off_m = from_beside()
    assert 0 < capped.onboard.status.follower_fallbacks < 500
    assert off_m < 5e-3


def test_far_off_the_path_the_tangent_model_is_not_used() -> None:
    follower = MpcFollower(VEHICLE)
    now, ahead = standing_inputs()
    now[tracking.LATERAL] = now[tracking.NOZZLE_LATERAL] = 1.0
    twist = follower.step(now, ahead)
    assert follower.fallbacks == 1
    assert twist.yaw_rate_radps < 0.0 and twist.actuators is None


def test_progress_does_not_jump_at_a_crossing() -> None:
    """A figure of eight: at the crossing both branches are equally near."""
    loop = [(0.0, 4.0), (0.9, 1.5 * math.pi / 0.9), (0.0, 4.0)]
    curves = chain(*loop)
    run = start(trajectory(curves))
    before, steps = 0.0, []
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
        arc = run.onboard.status.arc_length_m
        steps.append(arc - before)
        before = arc
    assert min(steps) >= 0.0
    assert max(steps) < 0.02
    assert run.onboard.state == TraversalStatus.DONE
