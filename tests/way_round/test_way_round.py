"""A robot that meets what its plan does not know: it waits, goes round, comes back, and says what it left out."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import touchline
from tests.way_round.met import FIELD, MARKER, PERSON, leaving, meeting
from touchline.checking.check_files import check_file
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.sweep.task import Task, perform
from touchline.jobs.way_round.drives_report import gap_words
from touchline.jobs.way_round.way_round_simulation import WayRoundDrives, WayRoundOutcome, simulate_way_round
from touchline.jobs.way_round.work_done import draw_work_done
from touchline.schemas.errors import CommandRefused, PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Polygon
from touchline.services.planner.collision.checker import MARGIN_M, CollisionChecker
from touchline.services.planner.collision.ways_round import WaysRound
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.plan import plan
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.way_round.rest_request import with_margin
from touchline.services.robot_sim.way_round.seen_things import SeenThings
from touchline.services.robot_sim.way_round.unpainted_lines import PASSING_BY
from touchline.services.robot_sim.way_round.waiting import WaitingOrder

pytestmark = pytest.mark.xdist_group("way round")  # by one worker, so that the job is planned and done once

STROKES = Products(strokes=True)


@cache
def job() -> Job:
    return Job.prepare(FIELD, PlanOptions(), MARKER)


class Answered(WayRoundDrives):
    """Drives of a robot that an operator answers as soon as it waits."""

    def __init__(self, emulator: Emulator, order: WaitingOrder) -> None:
        super().__init__(emulator, job())
        self._order = order

    def gives_up(self) -> str:
        self.way_round.answer(self._order)
        return super().gives_up()


def driven(person: dict[str, object], products: Products = STROKES, order: WaitingOrder | None = None):
    setup = meeting(person)
    emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard)
    return simulate_way_round(
        job(), emulator, products, drives=Answered(emulator, order) if order is not None else None
    )


@pytest.fixture(scope="module")
def stood(tmp_path_factory: pytest.TempPathFactory) -> WayRoundOutcome:
    """The job with a person who stands on its first line, recorded."""
    path = tmp_path_factory.mktemp("round") / "round.mcap"
    return driven(PERSON, Products(record=path, strokes=True))


def test_it_goes_round_and_reports_the_gap_that_the_paint_has(stood: WayRoundOutcome, tmp_path: Path) -> None:
    figures = stood.figures(job())
    assert figures["success"] and "contacts" not in figures, figures["reason"]
    assert figures["drives"][0].startswith("goes round ") and len(figures["drives"]) > 2
    (gap,) = stood.work.gaps
    assert gap.line_id == "s0" and gap.from_m < 6.0 < gap.to_m and gap.length_m < 5.0
    assert gap.outline.split()[0] in ("thing", "person", "post")
    assert f'left out beside "{gap.outline}"' in gap_words(gap)
    assert (gap.from_m, gap.to_m) == pytest.approx(_true_gap_m(stood.strokes), abs=0.02)
    paint, all_m = figures["paint"], sum(segment.curve().length_m for segment in FIELD.segments)
    assert paint["left_out_m"] == pytest.approx(gap.length_m)
    assert paint["of_all_lines_pct"] == pytest.approx((1.0 - gap.length_m / all_m) * paint["coverage_pct"])
    picture = tmp_path / "round.svg"
    draw_work_done(stood.work, stood.strokes, picture)
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


def test_in_python_it_is_the_same_session_with_a_table_of_all_drives(stood: WayRoundOutcome) -> None:
    run = touchline.simulate(touchline.plan(FIELD, vehicle=MARKER), scenario=meeting(PERSON).scenario)
    figures = stood.figures(job())
    assert run.success and run.hash == figures["hash"]["session"]
    assert all(run.figures[name] == figures[name] for name in ("paint", "gaps", "drives"))
    assert run.duration_s == pytest.approx(figures["traversal"]["total_time_s"])
    frame = run.frame(kind="numpy")
    assert (np.diff(frame["time_s"]) > 0.0).all() and len(frame) > 99.0 * run.duration_s
    painting = np.abs(frame["lateral_error_m"][frame["valve_open"]])
    assert painting.mean() == pytest.approx(run.errors()["lateral_mean_m"], abs=1e-3), "each drive by its own plan"
    assert "left out" not in run.reason and 'id="gap"' in run._repr_html_()


def test_a_sweep_has_the_figures_of_all_drives(stood: WayRoundOutcome) -> None:
    setup = meeting(PERSON)
    run = perform([job()], Task(0, 0, setup.scenario, setup.onboard))
    assert run.success and run.figures["total_time_s"] == stood.report.total_time_s
    assert run.figures["coverage_pct"] == stood.figures(job())["paint"]["coverage_pct"]


def test_what_has_gone_by_the_end_of_the_job_leaves_no_gap() -> None:
    outcome = driven(leaving(30.0))
    figures = outcome.figures(job())
    assert outcome.work.gaps == () and figures["success"], figures["reason"]
    assert figures["gaps"]["total_m"] == 0.0 and figures["drives"][-1] == "done"
    assert figures["paint"]["gap_m"] < 0.01, "the joint is painted as after a pause"


def test_a_robot_that_is_pushed_before_it_goes_round_says_why_it_stays_and_what_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(emulator: Emulator) -> None:
        if emulator.tick_count > 0:
            raise CommandRefused("cannot load here: the fixes contradict the estimate")

    monkeypatch.setattr(Emulator, "check_load", refuse)
    figures = driven(PERSON).figures(job())
    why, gaps = "cannot load here: the fixes contradict the estimate", figures["gaps"]["stretches"]
    assert figures["reason"] == why
    assert {each["line"]: each["reason"] for each in gaps} == dict.fromkeys(("s0", "s1"), f"not painted: {why}")


def test_an_operator_can_have_it_wait_or_leave_the_place_out_for_good() -> None:
    waited = driven(leaving(40.0), order=WaitingOrder.WAIT)
    assert waited.last.earlier == () and waited.work.gaps == () and waited.last.report.success
    left_out = driven(leaving(30.0), order=WaitingOrder.LEAVE_OUT)
    assert [gap.outline for gap in left_out.work.gaps] == ["operator"] and "done" in left_out.figures(job())["drives"]


def test_a_job_that_meets_nothing_has_the_usual_report() -> None:
    figures = driven({**PERSON, "y_m": -20.0}).figures(job())
    assert figures["success"] and "segments" in figures and "gaps" not in figures


def test_a_plan_takes_the_ground_of_the_standing_robot_as_free() -> None:
    assert PASSING_BY.left_m > MARGIN_M


@dataclass
class Shown:
    """Robot's computer as far as things in the way are asked of it."""

    estimate: tuple[float, float, float]
    tracks: list[SimpleNamespace]
    blocked: None = None

    @property
    def perception(self) -> SimpleNamespace:
        return SimpleNamespace(tracks=self.tracks)


def test_what_stood_is_remembered_until_the_robot_sees_that_it_has_gone() -> None:
    post = SimpleNamespace(
        moving=False, kind="post", number=1, outline_m=np.array([(9.0, 0.0), (9.2, 0.0), (9.1, 0.2), (9.0, 0.2)])
    )
    things = SeenThings()
    assert [each.id for each in things.look(Shown((8.0, 0.0, 0.0), [post]), ())] == ["post 1"]
    assert [each.id for each in things.look(Shown((-9.0, 0.0, 0.0), []), ())] == ["post 1"]
    assert things.look(Shown((7.0, 0.0, 0.0), []), ()) == []
    assert things.look(Shown((-9.0, 0.0, 0.0), []), ()) == []
    things.look(Shown((8.0, 0.0, 0.0), [post]), ())
    other = SimpleNamespace(moving=False, kind="post", number=1, outline_m=post.outline_m - (18.0, 0.0))
    assert [each.id for each in things.look(Shown((-8.0, 0.0, 0.0), [other]), ())] == ["post 1", "post 1 (earlier)"]


@pytest.mark.parametrize("hull", [[(0.7, -0.3), (1.2, -0.3), (1.2, 0.3)], [(-3, -3), (3, -3), (3, 3), (-3, 3)]])
def test_the_ground_of_the_robot_is_open_whatever_covers_it(hull: list[tuple[float, float]]) -> None:
    pose = (0.0, 0.0, 0.0)
    (outline,) = with_margin([Polygon(id="thing", corners=tuple(hull))], pose, MARKER, 0.5, PASSING_BY.left_m)
    checker = CollisionChecker.of(FIELD.model_copy(update={"obstacles": (outline,)}), MARKER)
    assert checker is not None and not checker.touches([PathPose(*pose)])
    assert not checker.touches([PathPose(-1.0, 0.0, 0.0)]), "it can drive back"


def test_a_thing_under_the_robot_is_no_outline() -> None:
    thing = Polygon(id="something", corners=((0.0, 0.0), (0.3, 0.0), (0.0, 0.3)))
    assert with_margin([thing], (0.0, 0.0, 0.0), MARKER, 0.0, PASSING_BY.left_m) == ()


@pytest.mark.parametrize("corner", [(0.75, 0.33), (0.15, -0.5), (-0.35, 0.33)])
def test_the_map_of_the_planner_has_the_standing_robot(corner: tuple[float, float]) -> None:
    (x, y), side = corner, math.copysign(1.0, corner[1])
    thing = [(x, y + 0.3 * side), (x + 0.3, y + 0.3 * side), (x + 0.3, y)] if x > 0.0 else [(x, y + 0.3), (x - 0.3, y)]
    far = (x + math.copysign(2.0, x), y + 2.0 * side)
    start = CurveEnd(PathPose(0.0, 0.0, 0.0), 0.0, 0.0)
    outlines = with_margin([Polygon(id="thing", corners=(*thing, far))], start.pose, MARKER, 0.9, PASSING_BY.left_m)
    checker = CollisionChecker.of(FIELD.model_copy(update={"obstacles": outlines}), MARKER)
    assert checker is not None
    transitions = transitions_of(MARKER, PlanOptions(), Limits.of(MARKER, PlanOptions()))
    assert WaysRound(checker, [(0.0, 0.0)], transitions).leaves(start)


def test_a_plan_from_where_the_robot_touches_something_is_refused_at_once() -> None:
    covered = FIELD.model_copy(update={"obstacles": (Polygon(id="bin", corners=((1, -1), (2, -1), (2, 1), (1, 1))),)})
    with pytest.raises(PlanningError, match='touches "bin"'):
        plan(covered, MARKER, PlanOptions(start=np.array([1.0, 0.0, 0.0])))
