"""A robot that meets what its plan does not know while it covers an area: it covers the rest, and says what is left."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from tests.way_round.met import FIELD, IN_YARD, MARKER, QUICK, SWEEPER, YARD
from tests.way_round.run_in_one_process import run_in_one_process
from touchline.bus import BusConfig
from touchline.checking.check_files import check_file
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.way_round.covered_areas import CoveredAreas, UncoveredPatch
from touchline.jobs.way_round.way_round_simulation import WayRoundDrives, WayRoundOutcome, simulate_way_round
from touchline.jobs.way_round.work_done import draw_work_done
from touchline.onboard import Onboard
from touchline.schemas.ground_piece import GroundPiece
from touchline.schemas.messages import Trajectory
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.services.robot_sim.accounting.area_raster import CELL_M, AreaRaster
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.way_round.remains import PLAN, TOO_SMALL
from touchline.services.robot_sim.way_round.uncovered_ground import (
    LeftOutGround,
    UncoveredGround,
    left_out_grounds,
    patches_of,
)
from touchline.services.robot_sim.way_round.way_round_job import goes_round

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker


@cache
def job() -> Job:
    return Job.prepare(YARD, QUICK, SWEEPER)


@dataclass(frozen=True)
class Covered:
    """The job with a person.

    Attributes:
        outcome: Its outcome.
        work: The work, and what is left undone.
        times: Passes over each cell (rows, columns) of a raster of the truth.
    """

    outcome: WayRoundOutcome
    work: CoveredAreas
    times: NDArray[np.uint8]

    @property
    def left_out(self) -> list[UncoveredPatch]:
        """Patches that the plan of the whole area covers."""
        return [each for each in self.work.patches if each.reason != PLAN]


def world(person: dict[str, object]) -> Setup:
    return Setup(vehicle=SWEEPER, scenario=Scenario.model_validate({"seed": 6, "objects": [person]}))


def covered(person: dict[str, object], record: Path | None = None) -> Covered:
    emulator = Emulator(SWEEPER, world(person).scenario)
    drives = WayRoundDrives(emulator, job())
    outcome = simulate_way_round(job(), emulator, Products(record=record, strokes=True), drives=drives)
    raster = AreaRaster([area.polygon for area in YARD.areas], SWEEPER.tool.width_m)
    raster.take(np.concatenate([work.ledger.rows(0) for work in drives.works]))
    assert isinstance(outcome.work, CoveredAreas)
    return Covered(outcome, outcome.work, raster.times)


@pytest.fixture(scope="module", autouse=True)
def tick_by_tick() -> Iterator[None]:
    """No nominal ticks in one kernel, which for wheels with a roller takes 20 s to compile; the bits are the same."""
    with pytest.MonkeyPatch.context() as onboard:
        onboard.setattr(Onboard, "nominal", lambda *_: None)
        yield


@pytest.fixture(scope="module")
def stood() -> Covered:
    """The job with a person who stands in the middle for good."""
    return covered(IN_YARD)


def test_it_covers_the_rest_and_reports_the_ground_beside_the_person(stood: Covered, tmp_path: Path) -> None:
    figures = stood.outcome.figures(job())
    assert figures["success"] and "contacts" not in figures, figures["reason"]
    assert figures["drives"][0].startswith("goes round ")
    patch = stood.left_out[0]
    assert patch.ground.contains(shapely.Point(IN_YARD["x_m"], IN_YARD["y_m"]))
    assert patch.reason.split()[0] in ("thing", "person", "post")
    assert f'left out beside "{patch.reason}"' in "".join(stood.work.warnings())
    assert all(each.reason for each in stood.work.patches)
    assert figures["uncovered"]["left_out_m2"] < 7.0
    assert figures["uncovered"]["patches"][0]["size_m2"] == max(each.ground.area for each in stood.work.patches)
    picture = tmp_path / "round.svg"
    draw_work_done(stood.work, stood.outcome.strokes, picture)
    assert 'id="uncovered"' in picture.read_text() and patch.reason in picture.read_text()


def test_the_reported_patches_are_those_of_a_raster_of_the_truth(stood: Covered) -> None:
    rows, columns = np.indices(stood.times.shape)
    middles = shapely.points(CELL_M * (columns + 0.5), CELL_M * (rows + 0.5))
    patches = shapely.union_all([each.ground for each in stood.work.patches])
    empty, inside = stood.times == 0, shapely.contains(patches, middles)
    astray = (empty != inside) & (shapely.distance(patches.boundary, middles) > CELL_M)
    assert not (astray & inside).any(), "what is reported as uncovered is"
    slivers_m2 = stood.work.ground.area.missed_m2 - patches.area
    assert astray.sum() * CELL_M**2 <= slivers_m2 + 0.05, "what is not reported is covered, but for slivers"


@pytest.mark.full
def test_a_recording_of_it_can_be_run_again(tmp_path: Path) -> None:
    recording = covered(IN_YARD, tmp_path / "round.mcap").outcome.last.recording
    assert recording is not None and recording["complete"]
    (verdict,) = check_file("", Path(recording["path"]))
    assert verdict.passed, verdict


@pytest.mark.full
def test_over_the_bus_it_does_the_same(stood: Covered, bus_config: BusConfig) -> None:
    run, figures, told = run_in_one_process(YARD, QUICK, world(IN_YARD), bus_config)
    here = stood.outcome.figures(job())
    assert figures["success"] and figures["drives"][0].startswith("goes round "), figures["reason"]
    assert figures["uncovered"]["left_out_m2"] == pytest.approx(here["uncovered"]["left_out_m2"], abs=1.0)
    for name in ("covered_m2", "planned_m2", "missed_m2"):
        assert figures["area"][name] == pytest.approx(here["area"][name], abs=1.5), name
    patch = next(each for each in run.work.patches if each.reason != PLAN)
    assert patch.ground.contains(shapely.Point(IN_YARD["x_m"], IN_YARD["y_m"]))
    assert any(f'left out beside "{patch.reason}"' in each for each in told)


def test_what_has_gone_by_the_end_of_the_job_leaves_no_patch() -> None:
    gone = covered({**IN_YARD, "motion": {"kind": "path", "points": [[6.1, 20.0]], "start_s": 90.0}})
    figures = gone.outcome.figures(job())
    assert figures["success"] and figures["drives"][0].startswith("goes round "), figures["reason"]
    assert figures["drives"][-1] == "done" and sum(each.ground.area for each in gone.left_out) < 0.3


def test_a_job_of_remaining_pieces_leaves_out_nothing_else() -> None:
    half = GroundPiece(area="yard", corners=((0, 0), (4.5, 0), (4.5, 6), (0, 6)))
    ground = UncoveredGround(YARD, SWEEPER, QUICK, (half,))
    assert sum(each.size_m2 for each in ground.undone.patches) == pytest.approx(27.0)
    rest = ground.rest((), ())
    assert rest is not None and sum(piece.polygon.area for piece in rest.pieces) == pytest.approx(27.0, abs=0.5)


def test_strips_that_a_drive_has_left_over_are_left_out_as_too_small() -> None:
    ground, strip, hole = UncoveredGround(YARD, SWEEPER, QUICK), shapely.box(0, 0, 9, 0.12), shapely.box(4, 2, 6, 4)
    ground.covered = shapely.box(0, 0, 9, 6).difference(shapely.union(strip, hole))
    rest = ground.rest((), ())
    assert rest is not None
    ground.note(rest, (), Trajectory(), ())
    assert {each.outline: each.size_m2 for each in ground.undone.patches} == {TOO_SMALL: pytest.approx(1.08), "": 4.0}
    assert ground.reasons_left == {""}, "it comes back for the hole alone"


def test_a_patch_that_has_several_reasons_is_cut() -> None:
    notes = [
        LeftOutGround("yard", shapely.box(0, 0, 3, 1), PLAN),
        LeftOutGround("yard", shapely.box(3, 0, 4, 1), "post 1"),
    ]
    (one, reason), (other, why), (rest, none) = patches_of(notes, "yard", shapely.box(0, 0, 4, 1.5))
    assert (one.area, reason, other.area, why, rest.area, none) == (3.0, PLAN, 1.0, "post 1", 2.0, "")
    *_, (strip, reason) = patches_of(notes, "yard", shapely.box(0, 0, 4, 1.1))
    assert reason == TOO_SMALL and strip.area == pytest.approx(0.4)
    ((whole, reason),) = patches_of(notes, "yard", shapely.box(0, 0, 2.8, 1.1))
    assert reason == PLAN and whole.area == pytest.approx(3.08)


def test_only_a_robot_with_a_lidar_goes_round_things_and_only_on_a_job_with_a_template() -> None:
    assert goes_round(SWEEPER, YARD) and goes_round(MARKER, FIELD)
    assert not goes_round(SWEEPER.model_copy(update={"sensors": ()}), YARD)
    assert not goes_round(SWEEPER, None)


def test_outlines_of_patches_leave_out_the_covered_ground_that_they_surround() -> None:
    ground = UncoveredGround(YARD, SWEEPER, QUICK)
    ground.covered = shapely.union(shapely.box(2, 1, 4, 3), shapely.box(5, 2, 7, 5))
    outlines = [shapely.Polygon(zip(each.corners_x_m, each.corners_y_m, strict=True)) for each in ground.undone.patches]
    told = shapely.union_all(outlines)
    assert sum(each.area for each in outlines) == pytest.approx(told.area) == pytest.approx(44.0)
    assert shapely.intersection(told, ground.covered).area == pytest.approx(0.0, abs=1e-9)
    assert shapely.union_all([each.ground for each in left_out_grounds(ground.undone.patches)]).area == told.area
