"""A robot that meets what its plan does not know: it waits, goes round, comes back, and says what it left out."""

from pathlib import Path

import numpy as np
import pytest

from tests.way_round.met import FIELD, MARKER, PERSON, leaving, meeting
from touchline.checking.check_files import check_file
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.way_round.drives_report import gap_words
from touchline.jobs.way_round.way_round_simulation import WayRoundDrives, WayRoundOutcome, simulate_way_round
from touchline.schemas.messages import PlanOptions
from touchline.services.planner.collision.checker import MARGIN_M
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.way_round.unpainted_lines import PASSING_BY
from touchline.services.robot_sim.way_round.waiting import WaitingOrder

JOB = Job.prepare(FIELD, PlanOptions(), MARKER)
STROKES = Products(strokes=True)


class Answered(WayRoundDrives):
    """Drives of a robot that an operator answers as soon as it waits."""

    def __init__(self, emulator: Emulator, order: WaitingOrder) -> None:
        super().__init__(emulator, JOB)
        self._order = order

    def gives_up(self) -> str:
        self.way_round.answer(self._order)
        return super().gives_up()


def driven(person: dict[str, object], products: Products = STROKES, order: WaitingOrder | None = None):
    setup = meeting(person)
    emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard)
    return simulate_way_round(JOB, emulator, products, drives=Answered(emulator, order) if order is not None else None)


@pytest.fixture(scope="module")
def stood(tmp_path_factory: pytest.TempPathFactory) -> WayRoundOutcome:
    """The job with a person who stands on its first line, recorded."""
    path = tmp_path_factory.mktemp("round") / "round.mcap"
    return driven(PERSON, Products(record=path, strokes=True))


def test_it_goes_round_and_reports_the_gap_that_the_paint_has(stood: WayRoundOutcome, tmp_path: Path) -> None:
    figures = stood.figures(JOB)
    assert figures["success"] and "contacts" not in figures, figures["reason"]
    assert figures["drives"][0].startswith("goes round ") and len(figures["drives"]) > 2
    (gap,) = stood.work.gaps
    assert gap.line_id == "s0" and gap.from_m < 6.0 < gap.to_m and gap.length_m < 5.0
    assert gap.outline.split()[0] in ("thing", "person", "post")
    assert f'left out beside "{gap.outline}"' in gap_words(gap)
    assert (gap.from_m, gap.to_m) == pytest.approx(_true_gap_m(stood.strokes), abs=0.02)
    picture = tmp_path / "round.svg"
    stood.work.draw(stood.strokes, picture)
    assert 'id="gap"' in picture.read_text() and gap.outline in picture.read_text()


def _true_gap_m(strokes):
    """Ends of the unpainted part of the line along y = 0, on a raster of 1 mm of the true paint."""
    painted = np.zeros(12_001, dtype=bool)
    for stroke in strokes:
        along = np.abs(stroke.y_m) < 0.05
        if along.any():
            x = stroke.x_m[along]
            low, high = np.clip((1e3 * x.min(), 1e3 * x.max()), 0, 12_000).astype(int)
            painted[low : high + 1] = True
    empty = np.flatnonzero(~painted[20:-20]) + 20
    return 1e-3 * empty[0], 1e-3 * empty[-1]


def test_a_recording_of_it_can_be_run_again(stood: WayRoundOutcome) -> None:
    assert stood.last.recording is not None and stood.last.recording["complete"]
    (verdict,) = check_file("", Path(stood.last.recording["path"]))
    assert verdict.passed, verdict
    assert verdict.sim_time_s > sum(each.report.total_time_s for each in stood.drives)


def test_what_has_gone_by_the_end_of_the_job_leaves_no_gap() -> None:
    outcome = driven(leaving(30.0))
    figures = outcome.figures(JOB)
    assert outcome.work.gaps == () and figures["success"], figures["reason"]
    assert figures["gaps"]["total_m"] == 0.0 and figures["drives"][-1] == "done"
    assert figures["paint"]["gap_m"] < 0.01, "the joint is painted as after a pause"


def test_an_operator_can_have_it_wait_or_leave_the_place_out_for_good() -> None:
    waited = driven(leaving(40.0), order=WaitingOrder.WAIT)
    assert waited.last.earlier == () and waited.work.gaps == () and waited.last.report.success
    left_out = driven(leaving(30.0), order=WaitingOrder.LEAVE_OUT)
    assert [gap.outline for gap in left_out.work.gaps] == ["operator"] and "done" in left_out.figures(JOB)["drives"]


def test_a_job_that_meets_nothing_has_the_usual_report() -> None:
    figures = driven({**PERSON, "y_m": -20.0}).figures(JOB)
    assert figures["success"] and "segments" in figures and "gaps" not in figures


def test_a_plan_takes_the_ground_of_the_standing_robot_as_free() -> None:
    assert PASSING_BY.left_m > MARGIN_M
