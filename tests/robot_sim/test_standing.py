"""A robot that is told to stand stands, whatever its accelerometer says: in every state, with any jolt, at any time."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks._drive_to import drive_to
from benchmarks._invariants import fault
from benchmarks._joints import field
from tests.with_full import with_full
from touchline.onboard import filter_model as model
from touchline.onboard.estimation.standing import LASTING_TICKS
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator

READY, RUNNING, PAUSED, DONE = (
    TraversalStatus.READY,
    TraversalStatus.RUNNING,
    TraversalStatus.PAUSED,
    TraversalStatus.DONE,
)
MOST_MPS2 = 10.0
"""Of one fault; more is several at once."""
JOLTS = {
    "50 ms of 10 m/s²": ("imu-bias", {"accel_mps2": 10.0, "gyro_radps": 0.0, "duration_s": 0.05}),
    "50 ms of -10 m/s²": ("imu-bias", {"accel_mps2": -10.0, "gyro_radps": 0.0, "duration_s": 0.05}),
    "0.5 s of 3 m/s²": ("imu-bias", {"accel_mps2": 3.0, "gyro_radps": 0.0, "duration_s": 0.5}),
    "2 s of 10 m/s²": ("imu-bias", {"accel_mps2": 10.0, "gyro_radps": 0.0, "duration_s": 2.0}),
    "shaking by 20 m/s²": ("imu-noisy", {"accel_mps2": 20.0, "gyro_radps": 0.0, "duration_s": 2.0}),
}
USUAL_JOLTS = ("50 ms of 10 m/s²", "shaking by 20 m/s²")
FOLLOWERS = ("mpc", "pure-pursuit")


def loaded(follower: str = "pure-pursuit", seed: int = 1) -> Emulator:
    emulator = Emulator(Vehicle(), Scenario(seed=seed), OnboardConfig.model_validate({"follower": follower}))
    emulator.load(field())
    return emulator


def driving(follower: str = "pure-pursuit", seed: int = 1, *, until_m: float = 3.0) -> Emulator:
    """Under way; the first line begins at 6 m."""
    emulator = loaded(follower, seed)
    emulator.start()
    drive_to(emulator, until_m)
    return emulator


def ticks(emulator: Emulator, count: int) -> float:
    """Let ticks pass; how far the robot has been from where it was [m]."""
    x, y, _ = emulator.world.pose
    far = 0.0
    for _ in range(count):
        emulator.tick()
        east, north, _ = emulator.world.pose
        far = max(far, math.hypot(east - x, north - y))
    return far


def jolt(emulator: Emulator, name: str, start_s: float = 0.0) -> None:
    kind, fields = JOLTS[name]
    emulator.inject_fault(fault(kind, start_s=start_s, **fields))


@pytest.mark.parametrize("follower", with_full("pure-pursuit", full=("mpc",)))
def test_jolts_move_neither_a_paused_robot_nor_what_it_believes(follower: str) -> None:
    emulator = driving(follower)
    emulator.inject_fault(fault("operator-lost", duration_s=10.0))
    ticks(emulator, 700)
    for name in JOLTS:
        assert emulator.onboard.state == PAUSED
        before, bias = emulator.onboard.estimate, _bias(emulator)
        jolt(emulator, name)
        for _ in range(300):
            assert ticks(emulator, 1) < 1e-3, name
            now = emulator.onboard.estimate
            assert math.hypot(now.east_m - before.east_m, now.north_m - before.north_m) < 0.005, name
            assert abs(now.speed_mps) < 0.01, name
            assert _bias(emulator) == pytest.approx(bias, abs=0.02), name
            assert emulator.command.actuators == (0.0, 0.0), name
        ticks(emulator, 20)
    emulator.resume()
    assert emulator.onboard.state == RUNNING


def _bias(emulator: Emulator) -> float:
    return float(emulator.onboard._estimator.state[model.ACCEL_BIAS])


@pytest.mark.parametrize("name", with_full(*USUAL_JOLTS, full=sorted(set(JOLTS) - set(USUAL_JOLTS))))
def test_nor_in_any_other_state(name: str) -> None:
    emulator = loaded()
    jolt(emulator, name)
    assert ticks(emulator, 250) < 0.01, "ready"

    emulator = loaded()
    emulator.start()
    jolt(emulator, name, start_s=0.05)
    while "aligning" in emulator.onboard.status.reason or not emulator.onboard.status.elapsed_s:
        assert ticks(emulator, 1) < 0.01, "aligning"
        assert emulator.onboard.status.elapsed_s < 30.0
    while emulator.onboard.status.arc_length_m < 3.0 and emulator.onboard.status.elapsed_s < 40.0:
        emulator.tick()
    if emulator.onboard.state == PAUSED:
        # Shaken while it learned how it stands, it may need the operator.
        assert "the fixes contradict the estimate" in emulator.onboard.status.reason
        assert ticks(emulator, 100) < 1e-3
        emulator = driving()

    emulator.inject_fault(fault("gnss-outage", duration_s=8.0))
    ticks(emulator, 400)
    while emulator.onboard.status.arc_length_m < 7.0 and emulator.onboard.state == RUNNING:
        emulator.tick()
    ticks(emulator, 200)
    if emulator.onboard.state == PAUSED:
        jolt(emulator, name)
        assert ticks(emulator, 200) < 0.01, "a hold"
        while emulator.onboard.state == PAUSED:
            emulator.tick()

    emulator.estop()
    ticks(emulator, 150)
    jolt(emulator, name)
    assert ticks(emulator, 20) < 0.01, "emergency-stopped"
    emulator.reset()
    assert ticks(emulator, 250) < 0.01, "reset"
    emulator.abort()
    jolt(emulator, name)
    assert ticks(emulator, 250) < 0.01, "aborted"
    emulator.load(field())
    assert emulator.onboard.state == READY


def test_nor_when_the_job_is_done() -> None:
    emulator = driving(until_m=34.9)
    while emulator.onboard.state != DONE:
        emulator.tick()
    ticks(emulator, 150)
    jolt(emulator, "50 ms of 10 m/s²")
    assert ticks(emulator, 200) < 0.01
    emulator.load(field())


@settings(max_examples=8, deadline=None)
@given(
    st.sampled_from(["pause", "abort", "estop"]),
    st.sampled_from(FOLLOWERS),
    st.floats(-40.0, 40.0),
    st.floats(0.01, 2.0),
    st.floats(0.0, 3.0),
    st.integers(0, 1000),
)
def test_it_stands_from_when_it_has_come_to_rest(
    order: str, follower: str, accel_mps2: float, duration_s: float, start_s: float, seed: int
) -> None:
    """Also if the jolt comes while it brakes; that takes half a metre without one."""
    emulator = driving(follower, seed, until_m=2.0)
    getattr(emulator, order)()
    several = math.ceil(abs(accel_mps2) / MOST_MPS2) or 1
    for _ in range(several):
        share = {"accel_mps2": accel_mps2 / several, "gyro_radps": 0.0}
        emulator.inject_fault(fault("imu-bias", start_s=start_s, duration_s=duration_s, **share))
    x, y, _ = emulator.world.pose
    braked = 0
    while emulator.onboard._estimator.buffer.still_ticks < 3:
        emulator.tick()
        braked += 1
        assert braked < 250
    east, north, _ = emulator.world.pose
    assert math.hypot(east - x, north - y) < 0.8
    assert ticks(emulator, 550) < 0.01
    assert emulator.onboard._traversal.job.standing


def test_a_jolt_while_a_robot_goes_on_is_waited_for() -> None:
    emulator = driving()
    emulator.pause()
    ticks(emulator, 200)
    emulator.resume()
    ticks(emulator, 180)  # it warns before it moves off
    jolt(emulator, "0.5 s of 3 m/s²")
    assert ticks(emulator, 45) < 1e-3
    assert "accelerometer contradicts" in emulator.onboard.status.reason
    ticks(emulator, 100)
    assert emulator.onboard.status.reason == ""
    assert abs(emulator.onboard.estimate.speed_mps) > 0.3


def test_what_lasts_is_a_bias_and_is_learned() -> None:
    """Else a robot that was tilted, or whose sensor has jumped, could not go on."""
    emulator = driving()
    emulator.pause()
    ticks(emulator, 200)
    before, bias = emulator.onboard.estimate, _bias(emulator)
    emulator.inject_fault(fault("imu-bias", accel_mps2=2.0, gyro_radps=0.0))
    ticks(emulator, LASTING_TICKS - 10)
    assert _bias(emulator) == pytest.approx(bias, abs=0.02)
    ticks(emulator, 50)
    assert _bias(emulator) == pytest.approx(bias + 2.0, abs=0.05)
    now = emulator.onboard.estimate
    assert math.hypot(now.east_m - before.east_m, now.north_m - before.north_m) < 0.005
    emulator.resume()
    ticks(emulator, 300)
    assert emulator.onboard.state == RUNNING
    x, y, _ = emulator.world.pose
    now = emulator.onboard.estimate
    assert math.hypot(now.east_m - x, now.north_m - y) < 0.04


def test_without_noise_an_imu_that_repeats_itself_at_rest_is_not_frozen() -> None:
    emulator = Emulator(Vehicle(), Scenario(noise="none"), OnboardConfig(follower="pure-pursuit"))
    emulator.load(field())
    emulator.start()
    drive_to(emulator, 2.0)
    emulator.abort()
    while emulator.active:
        emulator.tick()
    emulator.load(field())
    emulator.start()
    ticks(emulator, 300)
    assert emulator.onboard.state == RUNNING, emulator.onboard.status.reason
