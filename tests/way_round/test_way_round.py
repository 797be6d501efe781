"""A robot that meets what its plan does not know: it waits, goes round, comes back, and says what it left out."""

from pathlib import Path

import numpy as np
import pytest

from tests.planner.drawn import box, drawn
from tests.way_round.standing_thing import HeldRobot
from touchline.checking.check_files import check_file
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.way_round.waiting import WaitingOrder
from touchline.jobs.way_round.way_round_simulation import TimedWaitingOrder, WayRoundOutcome, simulate_way_round
from touchline.schemas.messages import PlanOptions

PERSON = box((9.8, -0.2), (10.2, 0.2), "person")
FIELD = drawn((0, 0, 20, 0), (0, 4, 20, 4))
NOTHING = Products()


def driven(
    robot: HeldRobot, products: Products = NOTHING, answers: tuple[TimedWaitingOrder, ...] = ()
) -> WayRoundOutcome:
    return simulate_way_round(robot, Job.prepare(FIELD, PlanOptions()), robot, products, answers)


def test_it_goes_round_and_reports_the_gap_that_the_paint_has() -> None:
    robot = HeldRobot(PERSON)
    outcome = driven(robot, Products(strokes=True))
    assert robot.closest_m > 0.02, "it has touched the person"
    assert [each.reason for each in outcome.last.earlier] == ["goes round person"] and outcome.last.reason == ""
    (gap,) = outcome.gaps
    assert (gap.line_id, gap.reason) == ("s0", "person") and gap.from_m < 9.8 and gap.to_m > 10.2
    assert gap.to_m - gap.from_m < 4.0
    strokes = [each for drive in (*outcome.last.earlier, outcome.last) for each in drive.strokes]
    assert gap[1:3] == pytest.approx(_true_gap_m(strokes), abs=0.02)


def _true_gap_m(strokes):
    """Ends of the unpainted part of the line along y = 0, on a raster of 1 mm of the true paint."""
    painted = np.zeros(20_001, dtype=bool)
    for stroke in strokes:
        along = np.abs(stroke.y_m) < 0.05
        if along.any():
            x = stroke.x_m[along]
            low, high = np.clip((1e3 * x.min(), 1e3 * x.max()), 0, 20_000).astype(int)
            painted[low : high + 1] = True
    empty = np.flatnonzero(~painted[20:-20]) + 20
    return 1e-3 * empty[0], 1e-3 * empty[-1]


def test_what_has_gone_by_the_end_of_the_job_leaves_no_gap() -> None:
    outcome = driven(HeldRobot(PERSON, gone_s=40.0))
    assert len(outcome.last.earlier) == 2 and outcome.gaps == ()
    figures = outcome.figures(Job.prepare(FIELD, PlanOptions()))
    assert figures["success"] and figures["gaps"]["total_m"] == 0.0
    assert figures["paint"]["gap_m"] < 0.01, "the joint is painted as after a pause"


def test_an_operator_can_have_it_wait_or_leave_the_place_out_for_good() -> None:
    waited = driven(HeldRobot(PERSON, gone_s=60.0), answers=(TimedWaitingOrder(15.0, WaitingOrder.WAIT),))
    assert waited.last.earlier == () and waited.gaps == ()
    left_out = driven(HeldRobot(PERSON, gone_s=40.0), answers=(TimedWaitingOrder(16.0, WaitingOrder.LEAVE_OUT),))
    assert [gap.reason for gap in left_out.gaps] == ["operator"] and len(left_out.last.earlier) == 1


def test_a_recording_of_it_can_be_run_again(tmp_path: Path) -> None:
    path = tmp_path / "round.mcap"
    outcome = driven(HeldRobot(PERSON), Products(record=path))
    assert outcome.last.recording is not None and outcome.last.recording["complete"]
    (verdict,) = check_file("", path)
    driven_s = sum(each.report.total_time_s for each in (*outcome.last.earlier, outcome.last))
    assert verdict.passed and verdict.sim_time_s > driven_s, verdict
