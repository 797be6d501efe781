"""Faults of the receiver and the sky: what its computer is told, and that it ends."""

import math

import numpy as np
import pytest

from tests.robot_sim.open_loop import REST, drive, errors, fault, fixes, second, solutions
from touchline.schemas.messages import GnssStatus
from touchline.schemas.scenario import GnssNoise, Obstruction

QUICK = {"reacquire_s": 0.5, "float_after_s": 0.5, "converge_min_s": 1.0, "converge_max_s": 1.0}


def test_outage_then_reacquisition_step_by_step():
    run = drive(600, second("gnss-outage"), gnss=GnssNoise(**QUICK))
    assert solutions(run) == [(0.1, 3), (1.1, 0), (2.6, 1), (3.2, 2), (4.3, 3)]
    unknown = [fix for fix in fixes(run) if fix.fix == GnssStatus.NONE]
    assert {fix.variance_m2 for fix in unknown} == {1e4}
    assert len({fix.east_m for fix in unknown}) == 1  # the last position is repeated


def test_by_default_a_fix_is_back_within_ten_seconds():
    spells = solutions(drive(1400, second("gnss-outage"), command=REST))
    assert spells[-1][1] == GnssStatus.FIXED
    assert 2.0 + 2.0 < spells[-1][0] < 2.0 + 10.0


def test_a_single_solution_errs_by_metres_and_says_so():
    far, near = [], []
    for seed in range(12):
        run = drive(230, second("gnss-degraded", fix="single"), seed=seed)
        single = [fix for fix in fixes(run) if fix.fix == GnssStatus.SINGLE]
        assert [fix.variance_m2 for fix in single] == pytest.approx([1.3**2] * len(single))
        far += [error for stamp, error in errors(run) if 1.0 < stamp <= 2.0]
        near += [error for stamp, error in errors(run) if stamp <= 1.0]
    assert np.sqrt(np.mean(np.square(far)) / 2) == pytest.approx(1.3, rel=0.3)
    assert max(near) < 0.06


def test_a_float_solution_leaves_the_fix_slowly_and_is_sometimes_over_confident():
    claimed = []
    for seed in range(20):
        run = drive(230, second("gnss-degraded"), seed=seed, command=REST)
        spell = [fix for fix in fixes(run) if fix.fix == GnssStatus.FLOAT]
        assert len({fix.variance_m2 for fix in spell}) == 1
        claimed.append(math.sqrt(spell[0].variance_m2))
        jump = [error for stamp, error in errors(run) if stamp == 1.1]
        assert jump[0] < 0.1
    assert {round(sigma, 6) for sigma in claimed} == {0.02, 0.3}
    assert 1 <= sum(sigma < 0.1 for sigma in claimed) <= 8  # a fifth of 20


def test_a_float_solution_has_left_the_fix_by_63_percent_after_five_seconds():
    """Its own error stands still here, so the distance is that times 1 − exp(−t / 5 s)."""
    still = GnssNoise(white_m=0, gauss_markov_1_m=0, gauss_markov_2_m=0, float_tau_s=1e12)
    degraded = fault("gnss-degraded", start_s=0.9)  # the first float solution is that of second 1
    away = {round(stamp, 1): error for stamp, error in errors(drive(6200, degraded, gnss=still, command=REST))}
    assert away[1.0] < 1e-6
    assert [away[3.0] / away[61.0], away[6.0] / away[61.0]] == pytest.approx(
        [1 - math.exp(-0.4), 1 - math.exp(-1)], rel=1e-3
    )


def test_a_wrong_fix_is_a_fix_and_no_fault_of_a_float_or_single_solution():
    both = drive(500, fault("gnss-wrong-fix", east_m=5.0), second("gnss-degraded", fix="single"), command=REST)
    plain = drive(500, second("gnss-degraded", fix="single"), command=REST)
    for fix, right in zip(fixes(both), fixes(plain), strict=True):
        assert fix.east_m - right.east_m == pytest.approx(5.0 if fix.fix == GnssStatus.FIXED else 0.0, abs=1e-6)


def test_what_a_float_solution_claims_can_be_given():
    run = drive(230, second("gnss-degraded", claimed_m=0.05))
    spell = [fix.variance_m2 for fix in fixes(run) if 1.0 < fix.stamp_s <= 2.0]
    assert spell == pytest.approx([0.0025] * 10)


def test_without_corrections_a_fix_is_held_drifts_and_then_jumps():
    quiet = {"white_m": 0, "burst_share": 0, "gauss_markov_1_m": 0, "gauss_markov_2_m": 0, **QUICK}
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
    sigmas = {round(fix.stamp_s, 2): math.sqrt(fix.variance_m2) for fix in fixes(run)}  # half of the drift
    assert [sigmas[at] for at in (1.0, 3.0, 5.0)] == pytest.approx([0.001, 0.01, 0.02], rel=0.01)


def test_corrections_that_come_back_in_time_leave_the_fix_as_it_was():
    run = drive(400, second("corrections-lost"), command=REST)
    plain = drive(400, command=REST)
    assert solutions(run) == [(0.1, 3)]
    assert [fix for fix in fixes(run) if fix.stamp_s > 2.05] == [fix for fix in fixes(plain) if fix.stamp_s > 2.05]
    assert [fix for fix in fixes(run) if 1.05 < fix.stamp_s < 2.0] != [
        fix for fix in fixes(plain) if 1.05 < fix.stamp_s < 2.0
    ]


@pytest.mark.parametrize("lost_s", [1.0, 1.45, 1.96])
def test_corrections_come_every_second_and_grow_old_without_a_leap_when_they_do_not(lost_s):
    """The age is the time since the last whole second in which there were some."""
    run = fixes(drive(700, fault("corrections-lost", start_s=lost_s, duration_s=4.0), command=REST))
    ages = {round(fix.stamp_s, 1): fix.correction_age_s for fix in run}
    for stamp_s, age_s in ages.items():
        last_s = 1.0 if lost_s + 0.005 < stamp_s <= lost_s + 4.005 else math.floor(stamp_s + 1e-9)
        assert age_s == pytest.approx(stamp_s - last_s, abs=1e-9), stamp_s


def test_without_corrections_a_fix_that_was_lost_is_not_found_again():
    """Neither from nothing nor from float: what is there can be held, and without any there is a single position."""
    lost = fault("corrections-lost", start_s=1.0, duration_s=8.0)
    out = fault("gnss-outage", start_s=2.0, duration_s=1.0)
    spells = solutions(drive(1300, lost, out, gnss=GnssNoise(**QUICK), command=REST))
    assert spells == [(0.1, 3), (2.1, 0), (3.6, 1), (9.6, 2), (10.7, 3)]
    degraded = fault("gnss-degraded", start_s=2.0, duration_s=1.0)
    spells = solutions(drive(1300, lost, degraded, gnss=GnssNoise(**QUICK), command=REST))
    assert spells == [(0.1, 3), (2.1, 2), (10.1, 3)]


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


def test_under_trees_the_solution_floats_and_near_them_it_is_noisy():
    trees = Obstruction(outline=((3, -1), (5, -1), (5, 1), (3, 1)), margin_m=2.0, noise_factor=4.0)
    run, plain = drive(900, sky=(trees,), gnss=GnssNoise(**QUICK)), drive(900, gnss=GnssNoise(**QUICK))
    clear = {fix.stamp_s: fix for fix in fixes(plain)}
    for fix in fixes(run):
        east = run[round(fix.stamp_s * 100) - 1].state.east_m
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
