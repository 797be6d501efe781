"""A killed process, and the one that comes after it: paint without gaps or twice, and figures of the whole job."""

import itertools

import pytest

from benchmarks._drive_to import drive_to
from tests.robot_sim.scripted import along_x
from touchline.onboard.interface import Checkpoint
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.recovery_state import EarlierWork

PLAN = along_x(0, 5, 10, 12, sprayed=[0, 1, 0])
OTHER = along_x(0, 3, sprayed=[0])
RUNNING, DONE = TraversalStatus.RUNNING, TraversalStatus.DONE


def drive(emulator, until=None, limit=6000):
    runner = FastRunner(emulator)
    if until is None:
        runner.run(limit)
    while until is not None and not until(emulator):
        emulator.tick()
        limit -= 1
        assert limit, f"still {emulator.onboard.status}"
    assert until is not None or not emulator.active, f"still {emulator.onboard.status}"


def strokes(*emulators):
    """(from, to) of the paint along x, in the order of x."""
    return sorted(
        (float(s.points[0, 0]), float(s.points[-1, 0]))
        for emulator in emulators
        for s in emulator.work.ledger.strokes()
    )


def joints(*emulators):
    """From where paint ends to where the next begins: positive is a gap, negative is painted twice."""
    painted = strokes(*emulators)
    ends = itertools.accumulate((end for _, end in painted), max)
    return [max(begin - end, begin - stroke_end) for end, (begin, stroke_end) in zip(ends, painted[1:], strict=False)]


def killed_at(arc_length_m, noise):
    emulator = Emulator(Vehicle(), Scenario(noise=noise, seed=3))
    emulator.load(PLAN)
    emulator.start()
    drive_to(emulator, arc_length_m)
    return emulator


@pytest.mark.parametrize("noise", ["default", pytest.param("none", marks=pytest.mark.full)])
def test_another_process_goes_on_without_a_gap(noise):
    before = killed_at(0.0, noise)
    for at in (5.004, 7.77, 9.9, 11.0):
        drive_to(before, at)
        after = Emulator(Vehicle(), Scenario(noise=noise, seed=3))
        after.load(PLAN, resume=before.onboard.checkpoint)
        after.start()
        drive(after)
        assert after.onboard.state == DONE, at
        painted = strokes(before, after)
        assert painted[0][0] == pytest.approx(5.015, abs=0.03), at
        assert max(end for _, end in painted) == pytest.approx(10.03, abs=0.03), at
        assert all(-0.02 < joint < 0.01 for joint in joints(before, after)), at


def test_before_a_line_it_first_goes_back_for_its_heading():
    """Driving on, it would reach the line with an uncertain heading, pause there, and only then go back."""
    for at_m, least_m in ((2.5, 2.5), (4.3, 2.0), (4.9, 2.0)):
        before, reached_m = killed_at(at_m, "default"), [at_m]
        after = Emulator(Vehicle(), Scenario(seed=3))
        after.load(PLAN, resume=before.onboard.checkpoint)
        after.start()
        while after.active:
            after.tick()
            reached_m.append(after.onboard.status.arc_length_m)
            assert after.onboard.state in (RUNNING, DONE), (at_m, after.onboard.status)
        assert min(reached_m) == pytest.approx(least_m, abs=0.05), at_m
        (stroke,) = strokes(before, after)
        assert stroke == pytest.approx((5.015, 10.03), abs=0.03), at_m


def test_killed_while_paused_and_while_going_back():
    before = killed_at(7.0, "none")
    before.pause()
    for _ in range(150):
        before.tick()
    before.resume()
    drive(before, lambda e: e.onboard.status.arc_length_m < 7.0)
    after = Emulator(Vehicle(), Scenario(noise="none"))
    after.load(PLAN, resume=before.onboard.checkpoint)
    after.start()
    drive(after)
    assert all(-0.02 < joint < 0.01 for joint in joints(before, after))


def test_sensors_go_on_as_if_they_had_lived_through_it():
    lived, later = (Emulator(Vehicle(), Scenario(seed=3)) for _ in range(2))
    lived.load(PLAN)
    for _ in range(700):
        lived.tick()
    later.load(PLAN, resume=Checkpoint(0, 0.0, None, tick=700))
    assert later.time_s == lived.time_s == 7.0
    for _ in range(100):
        lived.tick()
        later.tick()
        assert later.frame == lived.frame._replace(battery_fraction=later.frame.battery_fraction)


def test_what_has_gone_wrong_does_not_do_so_again():
    fault = {"kind": "bumper", "start_s": 3.0, "duration_s": 0.1}
    after = Emulator(Vehicle(), Scenario.model_validate({"faults": [fault]}), OnboardConfig(follower="pure-pursuit"))
    after.load(PLAN, resume=Checkpoint(0, 2.0, None, tick=500))
    after.start()
    drive(after)
    assert after.onboard.state == DONE


@pytest.mark.parametrize("checkpoint", [Checkpoint(3, 1.0, None), Checkpoint(0, 99.0, None), Checkpoint(-1, 0.0, None)])
def test_a_checkpoint_of_another_path_is_refused(checkpoint):
    with pytest.raises(CommandRefused, match="the path has no such place"):
        Emulator(Vehicle(), Scenario(noise="none")).load(PLAN, resume=checkpoint)


@pytest.mark.parametrize("at", [7.77, pytest.param(5.5, marks=pytest.mark.full)])
def test_figures_and_supplies_are_those_of_the_whole_job(at):
    """As if there had been no crash, but for the joint, the second run-up and what that takes."""
    whole, before = killed_at(99.0, "none"), killed_at(at, "none")
    after = Emulator(Vehicle(), Scenario(noise="none", seed=3))
    remains = EarlierWork(before.totals, before.work.ledger.rows(0))
    after.load(PLAN, None, before.onboard.checkpoint, remains)
    assert after.totals == before.totals
    assert paint_metrics(after.work.ledger) == paint_metrics(before.work.ledger)
    assert after.onboard.status.elapsed_s == before.onboard.status.elapsed_s
    after.start()
    drive(after)
    figures, known = paint_metrics(after.work.ledger), paint_metrics(whole.work.ledger)
    assert len(after.work.ledger.strokes()) == 2
    assert figures.coverage_pct == pytest.approx(known.coverage_pct, abs=1e-9)
    assert 0.0 < figures.painted_length_m - known.painted_length_m < 0.02
    twice_m = figures.double_paint_m2 / Vehicle().tool.spray_width_m
    assert twice_m == pytest.approx(figures.painted_length_m - known.painted_length_m, abs=1e-3)
    used, known_used = (Vehicle().tool.tank_l - e.world.supplies[0] for e in (after, whole))
    assert used == pytest.approx(known_used, rel=0.005)
    assert used > known_used
    assert after.world.supplies[1] < whole.world.supplies[1] < before.world.supplies[1]
    assert after.onboard.status.elapsed_s > whole.onboard.status.elapsed_s + 3.0
    assert after.time_s == pytest.approx(after.onboard.status.elapsed_s + 1.0, abs=0.02)
    moving = before.totals.errors[0] + after.work.estimator_error.sums[0]
    assert after.totals.errors[0] == moving > whole.totals.errors[0]


def test_what_a_fault_keeps_from_use_comes_back_when_it_ends():
    fault = {"kind": "tank-empty", "litres": 1.0, "start_s": 2.0, "duration_s": 10.0}
    scenario = Scenario.model_validate({"noise": "none", "faults": [fault]})
    before, after = Emulator(Vehicle(), scenario), Emulator(Vehicle(), scenario)
    before.load(PLAN)
    before.start()
    drive(before, lambda e: e.time_s >= 9.0)
    assert before.world.supplies[0] < 1.0
    after.load(PLAN, None, before.onboard.checkpoint, EarlierWork(before.totals, before.work.ledger.rows(0)))
    after.start()
    drive(after)
    assert Vehicle().tool.tank_l - 0.05 < after.world.supplies[0] < Vehicle().tool.tank_l


def test_a_gap_at_the_joint_shows_in_the_figures():
    """Paint that is lost, here the last 30 cm before the kill, is missing in the figures of the whole job."""
    before = killed_at(8.0, "none")
    after = Emulator(Vehicle(), Scenario(noise="none", seed=3))
    paint = before.work.ledger.rows(0)[:-30]
    after.load(PLAN, None, before.onboard.checkpoint, EarlierWork(before.totals, paint))
    after.start()
    drive(after)
    assert paint_metrics(after.work.ledger).gap_m == pytest.approx(0.3, abs=0.03)


def test_all_marks_come_once_more_as_the_last_ones_may_have_reached_nobody():
    before = killed_at(7.0, "none")
    before.work.ledger.take_marks()
    after = Emulator(Vehicle(), Scenario(noise="none", seed=3))
    after.load(PLAN, None, before.onboard.checkpoint, EarlierWork(before.totals, before.work.ledger.rows(0)))
    again = after.work.ledger.take_marks()
    assert again[0].first_index == 0
    assert again[-1].first_index + len(again[-1].x_m) == before.work.ledger.points
    assert after.work.ledger.take_marks() == []
