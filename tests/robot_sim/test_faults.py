"""Every fault: what it does to the robot and to what the computer is told, and that it ends."""

import json
import math
from typing import NamedTuple, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.faults import Fault, parse_fault
from schemas.messages import GnssStatus
from schemas.scenario import GnssNoise, Obstruction, Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.faults import FaultTimeline
from services.robot_sim.frames import Command, SensorFrame
from services.robot_sim.sensors.suite import Sensors
from services.robot_sim.world import body
from services.robot_sim.world.world import World

VEHICLE = Vehicle()
FAULTS = get_args(get_args(Fault)[0])
AHEAD = Command(10.0, 10.0, True, True)
REST = Command(0.0, 0.0, False, False)


class Tick(NamedTuple):
    frame: SensorFrame
    state: np.ndarray
    sprayed: bool
    width: float


def drive(ticks, *faults, command=AHEAD, seed=1, **scenario):
    """An open-loop run: the same commands, whatever the sensors say."""
    scenario = Scenario(seed=seed, faults=faults, **scenario)
    world, sensors, timeline = World(VEHICLE, scenario), Sensors(VEHICLE, scenario), FaultTimeline(scenario.faults)
    run = []
    for tick in range(1, ticks + 1):
        timeline.step(tick)
        world.step(command, tick, timeline.effects)
        frame = sensors.read(tick, world.state, timeline.effects)
        widths = world.trace[1:, body.TRACE_SPRAYING]
        run.append(Tick(frame, world.state.copy(), bool(widths.any()), float(widths.max())))
    return run


def fault(kind, **fields):
    return parse_fault(json.dumps({"kind": kind, **fields}))


def second(kind, **fields):
    """A fault that acts in the second second."""
    return fault(kind, start_s=1.0, duration_s=1.0, **fields)


def fixes(run):
    return [fix for tick in run for fix in tick.frame.gnss]


def errors(run):
    """(stamp, distance of the fix from the antenna's truth) of every fix."""
    return [
        (
            fix.stamp_s,
            math.hypot(
                fix.east_m - run[round(fix.stamp_s * 100) - 1].state[body.EAST],
                fix.north_m - run[round(fix.stamp_s * 100) - 1].state[body.NORTH],
            ),
        )
        for fix in fixes(run)
    ]


# --- the receiver ---

QUICK = {"reacquire_s": 0.5, "float_after_s": 0.5, "converge_min_s": 1.0, "converge_max_s": 1.0}


def solutions(run):
    """(first stamp, solution) of every spell."""
    spells = []
    for fix in fixes(run):
        if not spells or spells[-1][1] != fix.fix:
            spells.append((round(fix.stamp_s, 3), fix.fix))
    return spells


def test_outage_then_reacquisition_step_by_step():
    run = drive(600, second("gnss-outage"), gnss=GnssNoise(**QUICK))
    assert solutions(run) == [(0.1, 3), (1.1, 0), (2.6, 1), (3.2, 2), (4.3, 3)]
    unknown = [fix for fix in fixes(run) if fix.fix == GnssStatus.NONE]
    assert {fix.variance_m2 for fix in unknown} == {1e4}
    assert len({fix.east_m for fix in unknown}) == 1  # the last position is repeated


def test_by_default_a_fix_is_back_within_ten_seconds():
    for seed in range(8):
        spells = solutions(drive(1400, second("gnss-outage"), seed=seed, command=REST))
        assert spells[-1][1] == GnssStatus.FIXED
        assert 2.0 + 2.0 < spells[-1][0] < 2.0 + 10.0


def test_a_single_solution_errs_by_metres_and_says_so():
    far, near = [], []
    for seed in range(30):
        run = drive(230, second("gnss-degraded", fix="single"), seed=seed)
        single = [fix for fix in fixes(run) if fix.fix == GnssStatus.SINGLE]
        assert [fix.variance_m2 for fix in single] == pytest.approx([1.3**2] * len(single))
        far += [error for stamp, error in errors(run) if 1.0 < stamp <= 2.0]
        near += [error for stamp, error in errors(run) if stamp <= 1.0]
    assert np.sqrt(np.mean(np.square(far)) / 2) == pytest.approx(1.3, rel=0.3)
    assert max(near) < 0.06


def test_a_float_solution_leaves_the_fix_slowly_and_is_sometimes_over_confident():
    claimed = []
    for seed in range(40):
        run = drive(230, second("gnss-degraded"), seed=seed, command=REST)
        spell = [fix for fix in fixes(run) if fix.fix == GnssStatus.FLOAT]
        assert len({fix.variance_m2 for fix in spell}) == 1
        claimed.append(math.sqrt(spell[0].variance_m2))
        jump = [error for stamp, error in errors(run) if stamp == 1.1]
        assert jump[0] < 0.1
    assert {round(sigma, 6) for sigma in claimed} == {0.02, 0.3}
    assert 2 <= sum(sigma < 0.1 for sigma in claimed) <= 16  # a fifth of 40


def test_what_a_float_solution_claims_can_be_given():
    run = drive(230, second("gnss-degraded", claimed_m=0.05))
    spell = [fix.variance_m2 for fix in fixes(run) if 1.0 < fix.stamp_s <= 2.0]
    assert spell == pytest.approx([0.0025] * 10)


def test_without_corrections_a_fix_is_held_drifts_and_then_jumps():
    quiet = {"white_m": 0, "gauss_markov_1_m": 0, "gauss_markov_2_m": 0, **QUICK}
    run = drive(
        900,
        fault("corrections-lost", start_s=1.0, duration_s=6.0),
        gnss=GnssNoise(hold_s=4.0, hold_drift_mps=0.01, **quiet),
        command=REST,
    )
    assert solutions(run) == [(0.1, 3), (5.1, 1), (7.6, 2), (8.7, 3)]
    by_stamp = dict(errors(run))
    assert by_stamp[1.0] < 1e-6
    assert by_stamp[3.0] == pytest.approx(0.02, rel=0.01)
    assert by_stamp[5.0] == pytest.approx(0.04, rel=0.01)
    assert by_stamp[5.1] > 0.3
    assert by_stamp[8.8] < 1e-6
    ages = {round(fix.stamp_s, 2): fix.correction_age_s for fix in fixes(run)}
    assert ages[5.0] == pytest.approx(4.0)
    assert ages[8.0] < 1.0


def test_corrections_that_come_back_in_time_leave_the_fix_as_it_was():
    run = drive(400, second("corrections-lost"), command=REST)
    plain = drive(400, command=REST)
    assert solutions(run) == [(0.1, 3)]
    assert [fix for fix in fixes(run) if fix.stamp_s > 2.05] == [fix for fix in fixes(plain) if fix.stamp_s > 2.05]
    assert [fix for fix in fixes(run) if 1.05 < fix.stamp_s < 2.0] != [
        fix for fix in fixes(plain) if 1.05 < fix.stamp_s < 2.0
    ]


def test_a_wrong_fix_is_off_and_looks_right():
    run, plain = drive(320, second("gnss-wrong-fix", east_m=0.5, north_m=-0.2)), drive(320)
    for fix, right in zip(fixes(run), fixes(plain), strict=True):
        wrong = 1.0 < fix.stamp_s <= 2.0
        assert fix.east_m - right.east_m == pytest.approx(0.5 if wrong else 0.0, abs=1e-6)
        assert fix.north_m - right.north_m == pytest.approx(-0.2 if wrong else 0.0, abs=1e-6)
        assert fix[3:] == right[3:]


@pytest.mark.parametrize("honest", [True, False])
def test_a_noisy_receiver_scatters_and_may_say_so(honest):
    run = drive(2300, fault("gnss-noisy", white_m=0.1, honest=honest, start_s=1.0, duration_s=20.0), command=REST)
    noisy = [error for stamp, error in errors(run) if 1.0 < stamp <= 21.0]
    assert np.sqrt(np.mean(np.square(noisy)) / 2) == pytest.approx(0.1, rel=0.15)
    assert max(error for stamp, error in errors(run) if not 1.0 < stamp <= 21.0) < 0.06
    plain = fixes(run)[0].variance_m2
    during = next(fix.variance_m2 for fix in fixes(run) if fix.stamp_s > 1.05)
    assert during == pytest.approx(plain + (0.01 if honest else 0.0))


def test_the_receivers_clock_is_off_and_drifts():
    run = drive(320, second("clock-skew", offset_s=0.05, drift_ppm=10000), gnss=GnssNoise(latency_jitter_s=0))
    stamps = [(tick.frame.time_s, fix.stamp_s) for tick in run for fix in tick.frame.gnss]
    for time_s, stamp_s in stamps:
        measured_s = time_s - 0.11
        skew = 0.05 + 0.01 * (measured_s - 1.0) if 1.005 < measured_s < 2.005 else 0.0
        assert stamp_s == pytest.approx(measured_s + skew, abs=1e-9)


# --- the sky ---


def test_under_trees_the_solution_floats_and_near_them_it_is_noisy():
    trees = Obstruction(outline=((3, -1), (5, -1), (5, 1), (3, 1)), margin_m=2.0, noise_factor=4.0)
    run, plain = drive(900, sky=(trees,), gnss=GnssNoise(**QUICK)), drive(900, gnss=GnssNoise(**QUICK))
    clear = {fix.stamp_s: fix for fix in fixes(plain)}
    for fix in fixes(run):
        east = run[round(fix.stamp_s * 100) - 1].state[body.EAST]
        if east < 1.0:
            assert fix == clear[fix.stamp_s]
        elif east < 2.99:
            assert fix.fix == GnssStatus.FIXED
            assert fix.variance_m2 > clear[fix.stamp_s].variance_m2
            assert fix.satellites <= clear[fix.stamp_s].satellites
        elif 3.0 < east < 5.0:
            assert fix.fix == GnssStatus.FLOAT
    assert solutions(run)[-1][1] == GnssStatus.FIXED
    assert fixes(run)[-1] == fixes(plain)[-1]


@pytest.mark.parametrize("best, fix", [("none", 0), ("single", 1), ("fixed", 3)])
def test_an_obstruction_leaves_what_it_leaves(best, fix):
    roof = Obstruction(outline=((-1, -1), (1, -1), (0, 2)), best_fix=best)
    assert fixes(drive(30, sky=(roof,), command=REST))[0].fix == fix


# --- messages ---


def ages(run, sensor):
    return [getattr(tick.frame, f"{sensor}_age_ticks") for tick in run]


@pytest.mark.parametrize("sensor, name", [("imu", "imu"), ("magnetometer", "mag"), ("encoder", "encoder")])
def test_late_samples_are_old_and_unchanged(sensor, name):
    run, plain = drive(300, second("messages-late", sensor=sensor, delay_s=0.05)), drive(300)
    seen = ages(run, name)
    assert seen[:100] == [0] * 100
    assert seen[100:105] == [1, 2, 3, 4, 5]
    assert seen[105:200] == [5] * 95
    assert seen[-90:] == [0] * 90
    field = {"imu": "imu", "mag": "mag", "encoder": "encoders"}[name]
    for tick, age in enumerate(seen):
        assert getattr(run[tick].frame, field) == getattr(plain[tick - age].frame, field)


def test_lost_samples_leave_the_last_one():
    run = drive(300, second("messages-lost", sensor="encoder"))
    assert ages(run, "encoder")[100:200] == list(range(1, 101))
    assert ages(run, "encoder")[200] == 0
    half = ages(drive(300, second("messages-lost", sensor="imu", share=0.5)), "imu")
    assert 25 < sum(age > 0 for age in half[100:200]) < 75
    assert not any(half[:100]) and not any(half[200:])


def test_samples_out_of_order_are_now_older_now_newer():
    run = ages(drive(300, second("messages-reordered", sensor="imu", spread_s=0.05)), "imu")
    stamps = np.arange(300) - run
    assert (np.diff(stamps[100:205]) < 0).any()
    assert max(run[:100]) == 0 and max(run[210:]) == 0
    assert max(run) <= 11


def test_a_sample_that_comes_again_replaces_newer_ones():
    run = ages(drive(300, second("messages-duplicated", sensor="imu", after_s=0.03, share=0.2)), "imu")
    assert set(run[100:200]) == {0}  # a newer one comes in every tick, and wins
    run = drive(
        300,
        second("messages-duplicated", sensor="imu", after_s=0.03),
        fault("messages-lost", sensor="imu", start_s=1.5, duration_s=0.1),
    )
    assert ages(run, "imu")[150:160] == [3, 3, 3, 4, 5, 6, 7, 8, 9, 10]


def test_late_fixes_keep_their_stamp():
    run, plain = drive(330, second("messages-late", sensor="gnss", delay_s=0.3)), drive(330)
    assert {fix.stamp_s: fix for fix in fixes(run)}.items() >= {
        fix.stamp_s: fix for fix in fixes(plain) if fix.stamp_s < 2.5
    }.items()
    late = [
        round(tick.frame.time_s - fix.stamp_s, 2)
        for tick in run
        for fix in tick.frame.gnss
        if 1.05 < fix.stamp_s < 2.05
    ]
    assert late and min(late) >= 0.41


def test_fixes_come_twice_out_of_order_or_never():
    twice = drive(330, second("messages-duplicated", sensor="gnss", after_s=0.15))
    stamps = [fix.stamp_s for fix in fixes(twice)]
    assert [round(stamp, 1) for stamp in sorted(set(stamps)) if stamps.count(stamp) == 2] == [
        round(1.1 + k / 10, 1) for k in range(10)
    ]
    assert stamps != sorted(stamps)
    mixed = [fix.stamp_s for fix in fixes(drive(330, second("messages-reordered", sensor="gnss", spread_s=0.5)))]
    assert mixed != sorted(mixed)
    assert sorted(set(mixed)) == sorted(mixed)
    lost = [round(fix.stamp_s, 1) for fix in fixes(drive(330, second("messages-lost", sensor="gnss")))]
    assert lost[:10] == [round(0.1 + k / 10, 1) for k in range(10)]
    assert lost[10] == 2.1


def test_several_fixes_can_arrive_in_one_tick():
    run = drive(330, second("messages-duplicated", sensor="gnss", after_s=0.0))
    assert {len(tick.frame.gnss) for tick in run} == {0, 1, 2}


# --- inertial, magnetic, wheels ---


def test_the_imus_bias_jumps_and_goes():
    run, plain = drive(300, second("imu-bias", gyro_radps=0.05, accel_mps2=-0.3)), drive(300)
    gyro = [a.frame.imu.gyro_z_radps - b.frame.imu.gyro_z_radps for a, b in zip(run, plain, strict=True)]
    accel = [a.frame.imu.accel_x_mps2 - b.frame.imu.accel_x_mps2 for a, b in zip(run, plain, strict=True)]
    assert gyro == pytest.approx([0.0] * 100 + [0.05] * 100 + [0.0] * 100)
    assert accel == pytest.approx([0.0] * 100 + [-0.3] * 100 + [0.0] * 100)


def test_a_shaken_imu_is_noisy_on_every_axis():
    run, plain = drive(300, second("imu-noisy", gyro_radps=0.1, accel_mps2=2.0)), drive(300)
    added = np.array([np.subtract(a.frame.imu, b.frame.imu) for a, b in zip(run, plain, strict=True)])
    assert np.std(added[100:200], axis=0) == pytest.approx([0.1] * 3 + [2.0] * 3, rel=0.3)
    assert not added[:100].any() and not added[200:].any()


def test_a_frozen_imu_repeats_itself():
    run, plain = drive(300, second("imu-stuck")), drive(300)
    assert {tick.frame.imu for tick in run[100:200]} == {run[99].frame.imu}
    assert [tick.frame.imu for tick in run[200:]] == [tick.frame.imu for tick in plain[200:]]


def test_a_disturbed_field_is_the_maps():
    run, plain = drive(300, second("magnetic-disturbance", east_t=5e-6)), drive(300)
    for index, (tick, right) in enumerate(zip(run, plain, strict=True)):
        heading = tick.state[body.HEADING]
        extra = 5e-6 if 100 <= index < 200 else 0.0
        assert tick.frame.mag.x_t - right.frame.mag.x_t == pytest.approx(extra * math.cos(heading), abs=3e-7)
        assert tick.frame.mag.y_t - right.frame.mag.y_t == pytest.approx(-extra * math.sin(heading), abs=3e-7)


def test_an_encoder_that_drops_out_never_catches_up():
    run, plain = drive(300, second("encoder-dropout", wheel="left")), drive(300)
    left = np.array([tick.frame.encoders.left_rad for tick in run])
    right = np.array([tick.frame.encoders.left_rad for tick in plain])
    assert (left[:100] == right[:100]).all()
    assert np.ptp(left[99:200]) == 0.0
    missed = right[200:] - left[200:]
    assert np.ptp(missed) < 1e-3
    assert missed[0] == pytest.approx(10.0, rel=0.02)
    assert [tick.frame.encoders.right_rad for tick in run] == [tick.frame.encoders.right_rad for tick in plain]
    assert np.array_equal(run[-1].state, plain[-1].state)


# --- the body and its actuators ---


def test_a_blocked_wheel_stands_and_turns_the_robot():
    run = drive(400, second("wheel-blocked", wheel="left"), noise="none")
    assert run[99].state[body.YAW_RATE] == pytest.approx(0.0, abs=1e-6)
    assert {float(tick.state[body.LEFT_RATE]) for tick in run[100:200]} == {0.0}
    assert run[199].state[body.HEADING] > 0.5
    assert run[199].frame.encoders.left_rad == run[100].frame.encoders.left_rad
    assert run[-1].state[body.LEFT_RATE] == pytest.approx(10.0, abs=0.2)
    assert run[-1].state[body.YAW_RATE] == pytest.approx(0.0, abs=0.02)


def test_a_slipping_wheel_turns_without_getting_on():
    run = drive(400, second("wheel-slip", share=0.5), noise="none")
    assert run[199].state[body.LEFT_RATE] == pytest.approx(10.0, abs=0.2)
    assert run[199].state[body.SPEED] == pytest.approx(0.5, abs=0.05)
    assert run[-1].state[body.SPEED] == pytest.approx(run[99].state[body.SPEED], abs=0.02)


def test_a_weak_motor_cannot_keep_up():
    hill = {"grade": 0.15, "uphill_rad": 0.0}
    run = drive(500, second("motor-weak", wheel="both", share=0.02), noise="none", ground=hill)
    assert run[99].state[body.LEFT_RATE] == pytest.approx(10.0, abs=0.2)
    assert run[199].state[body.LEFT_RATE] < 5.0
    assert run[-1].state[body.LEFT_RATE] == pytest.approx(10.0, abs=0.3)


def test_a_valve_stuck_open_sprays_whatever_is_commanded():
    run = drive(300, second("valve-stuck", position="open"), command=Command(10.0, 10.0, False, False))
    assert [tick.sprayed for tick in run] == [False] * 100 + [True] * 103 + [False] * 97  # closes in 30 ms
    assert run[150].state[body.VALVE_OPEN] == 1.0


def test_a_valve_stuck_closed_sprays_nothing():
    run = drive(300, second("valve-stuck", position="closed"))
    sprayed = [tick.sprayed for tick in run]
    assert all(sprayed[2:100]) and not any(sprayed[101:200]) and all(sprayed[202:])
    assert run[199].state[body.TANK_L] == run[101].state[body.TANK_L]


def test_stuck_discs_stay():
    run = drive(300, second("disc-stuck", position="up"))
    assert [run[tick].state[body.DISC_DOWN] for tick in (99, 100, 199, 240, 251)] == [1.0, 0.0, 0.0, 0.0, 1.0]


def test_a_clogged_nozzle_paints_a_narrower_line_with_less_paint():
    run = drive(300, second("nozzle-clogged", share=0.25))
    assert [run[tick].width for tick in (50, 150, 250)] == [1.0, 0.5, 1.0]
    flow = VEHICLE.paint_l_per_m * VEHICLE.paint_speed_mps
    assert [run[tick].state[body.FLOW_LPS] for tick in (50, 150, 250)] == pytest.approx([flow, flow / 4, flow])


def test_the_bumper_is_pressed():
    assert [tick.frame.bumper for tick in drive(300, second("bumper"))] == [False] * 100 + [True] * 100 + [False] * 100


def test_nobody_is_heard():
    alive = [tick.frame.operator_alive for tick in drive(300, second("operator-lost"))]
    assert alive == [True] * 100 + [False] * 100 + [True] * 100


def test_a_low_battery_is_reported_and_replaced():
    run = drive(300, second("battery-low", fraction=0.1))
    charge = [tick.frame.battery_fraction for tick in run]
    assert charge[99] > 0.999 and charge[100] == pytest.approx(0.1, abs=1e-4) and charge[199] < 0.1
    assert charge[200] > 0.998
    assert charge == sorted(charge[:100], reverse=True) + sorted(charge[100:200], reverse=True) + charge[200:]


def test_an_empty_battery_stops_the_robot():
    run = drive(700, fault("battery-low", fraction=0.0, start_s=1.0, duration_s=4.0), noise="none")
    assert run[99].state[body.SPEED] > 0.9
    assert run[499].state[body.SPEED] < 0.3
    assert run[-1].state[body.SPEED] > 0.9


def test_an_empty_tank_paints_nothing_until_it_is_refilled():
    run = drive(300, second("tank-empty"))
    assert [run[tick].frame.tank_l for tick in (100, 199)] == [0.0, 0.0]
    assert not any(tick.sprayed for tick in run[100:200])
    assert all(tick.sprayed for tick in run[200:])
    assert run[200].frame.tank_l == pytest.approx(run[99].frame.tank_l, abs=1e-3)


# --- one fault changes no other noise ---

TOUCHES = {
    "gnss-outage": ({}, {"gnss"}),
    "gnss-degraded": ({}, {"gnss"}),
    "corrections-lost": ({}, {"gnss"}),
    "gnss-wrong-fix": ({}, {"gnss"}),
    "gnss-noisy": ({}, {"gnss"}),
    "clock-skew": ({}, {"gnss"}),
    "imu-bias": ({}, {"imu"}),
    "imu-noisy": ({}, {"imu"}),
    "imu-stuck": ({}, {"imu"}),
    "magnetic-disturbance": ({}, {"mag"}),
    "encoder-dropout": ({}, {"encoders"}),
    "bumper": ({}, set()),
    "operator-lost": ({}, set()),
    "valve-stuck": ({"position": "open"}, set()),
    "disc-stuck": ({"position": "up"}, set()),
}
SENSED = ("imu", "mag", "encoders", "gnss")


@pytest.mark.parametrize("kind", TOUCHES)
def test_a_fault_of_one_sensor_changes_no_bit_of_another_nor_of_itself_once_it_is_over(kind):
    fields, touched = TOUCHES[kind]
    run = drive(1300, second(kind, **fields), command=REST)
    plain = drive(1300, command=REST)
    if kind == "encoder-dropout":
        touched = set()  # at rest nothing is missed
    for name in SENSED:
        same = [getattr(a.frame, name) == getattr(b.frame, name) for a, b in zip(run, plain, strict=True)]
        assert all(same[:100]), name
        assert all(same) == (name not in touched), name
        assert all(same[-50:]), name


@pytest.mark.parametrize("sensor", ["gnss", "imu", "magnetometer", "encoder"])
@pytest.mark.parametrize("kind", ["messages-late", "messages-lost", "messages-duplicated", "messages-reordered"])
def test_messages_that_go_astray_change_no_measurement(kind, sensor):
    fields = {"sensor": sensor, **({"delay_s": 0.1} if kind == "messages-late" else {})}
    run, plain = drive(400, second(kind, **fields)), drive(400)
    assert set(fixes(run)) <= set(fixes(plain))
    for name, age in (("imu", "imu"), ("mag", "mag"), ("encoders", "encoder")):
        for index, tick in enumerate(run):
            assert getattr(tick.frame, name) == getattr(plain[index - ages([tick], age)[0]].frame, name)
    assert np.array_equal(run[-1].state, plain[-1].state)


def test_a_fault_of_the_drive_changes_no_sensor_noise():
    run, plain = drive(300, second("wheel-blocked")), drive(300)

    def noise(tick):
        return (
            tick.frame.imu.gyro_z_radps - tick.state[body.MEAN_YAW_RATE],
            tick.frame.imu.accel_x_mps2 - tick.state[body.MEAN_ACCEL_X],
        )

    for a, b in zip(run, plain, strict=True):
        assert noise(a) == pytest.approx(noise(b), abs=1e-9)
    for a, b in zip(errors(run), errors(plain), strict=True):
        assert a == pytest.approx(b, abs=1e-6)


# --- anything at all ---

TIMES = {"start_s": st.floats(0, 3), "duration_s": st.none() | st.floats(0.01, 3)}
NEEDED = {"delay_s": st.floats(0.01, 5), "white_m": st.floats(0.001, 100), "share": st.floats(0, 0.95)}
ANY_FAULT = st.one_of(
    [st.builds(model, **TIMES, **{k: v for k, v in NEEDED.items() if k in model.model_fields}) for model in FAULTS]
)


@settings(max_examples=60, deadline=None)
@given(st.lists(ANY_FAULT, max_size=12), st.integers(0, 2**62))
def test_whatever_goes_wrong_the_world_stays_finite_and_the_same_again(faults, seed):
    run = drive(300, *faults, seed=seed)
    for tick in run:
        assert np.isfinite(tick.state).all()
        assert np.isfinite([*tick.frame.imu, *tick.frame.mag, *tick.frame.encoders]).all()
        assert all(np.isfinite(fix).all() for fix in tick.frame.gnss)
        assert 0.0 <= tick.frame.battery_fraction <= 1.0
        assert 0.0 <= tick.frame.tank_l <= VEHICLE.tank_l
        assert abs(tick.state[body.SPEED]) < 3.0
    again = drive(300, *faults, seed=seed)
    assert [tick.frame for tick in again] == [tick.frame for tick in run]
