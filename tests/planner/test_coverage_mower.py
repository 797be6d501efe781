"""Areas by a small machine on two driven wheels, whose body is wider than its tool, and by every area method."""

import math

import pytest

from benchmarks.fields import mower
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Area, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.coverage_machine import CoverageMachine, machine_of
from touchline.services.planner.coverage.wall_slide import SLIDE_M, WallSlide
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import plan

LAWN = Template(name="lawn", areas=(Area(id="lawn", outline=((0.0, 0.0), (18.0, -2.0), (21.0, 9.0), (3.0, 14.0))),))


def machine(vehicle: Vehicle) -> CoverageMachine:
    return machine_of(vehicle, Limits.of(vehicle, PlanOptions()))


@pytest.mark.full
def test_a_mower_drives_a_lap_and_covers_what_it_can_reach_in_little_more_than_the_least_time() -> None:
    vehicle = mower()
    report = plan(LAWN, vehicle).report
    (figures,) = report.coverage
    bound_s = figures.area_m2 / (vehicle.tool.width_m * vehicle.tool.work_speed_mps)
    assert figures.reachable_pct >= 99.0 and figures.laps >= 4 and figures.body_outside_m < 0.0
    assert report.total_time_s <= 1.25 * bound_s


@pytest.mark.parametrize("name", ["clay-roller", "mower"])
def test_every_area_method_gives_figures_of_coverage(name: str) -> None:
    vehicle = mower() if name == "mower" else load_vehicle(name)
    size = 40.0 if name == "clay-roller" else 6.0
    field = Area(id="field", outline=((0.0, 0.0), (size, 0.0), (size, 0.5 * size), (0.0, 0.5 * size)))
    for method in ("zigzag", "parallel"):
        (figures,) = plan(
            Template(name="field", areas=(field,)), vehicle, PlanOptions(area_method=method)
        ).report.coverage
        assert figures.method == method and figures.area_m2 == 0.5 * size**2 and figures.lanes > 0
    assert figures.coverage_pct == pytest.approx(100.0, abs=0.01), "parallel swaths cover all of a rectangle"


def test_a_marker_s_areas_have_figures_and_a_robot_without_a_tool_is_refused_them() -> None:
    lawn = Area(id="lawn", outline=((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (0.0, 1.0)))
    template = Template(name="lawn", areas=(lawn,))
    (figures,) = plan(template, Vehicle()).report.coverage
    assert figures.method == "parallel" and figures.coverage_pct == pytest.approx(100.0, abs=0.01)
    with pytest.raises(PlanningError, match=r'the area "lawn", and .* has no tool'):
        plan(template, load_vehicle("turtlebot2"))


def test_a_body_with_room_to_swing_slides_off_walls_as_sharply_as_it_can() -> None:
    roller, small = machine(load_vehicle("clay-roller")), machine(mower())
    slide = WallSlide.of(roller, 0.02)
    assert slide == WallSlide(SLIDE_M, roller.sharpness_max_1pm2, roller.sharpness_max_1pm2, both=False)
    slide = WallSlide.of(small, 0.02)
    assert slide.both and slide.backward_1pm2 < slide.forward_1pm2 < small.sharpness_max_1pm2
    for direction in (1, -1):
        path = PiecePath(PathPose(0.0, 0.0, 0.0), slide.pieces(direction))
        assert path.end.y_m > 0.9 * SLIDE_M
        assert math.remainder(path.end.heading_rad, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_seconds_count_stops_turns_on_the_spot_and_slow_bends() -> None:
    small = machine(mower())
    assert small.can_spin and small.bend_s_per_m > 0.0 and small.beside_m == 0.33
    ahead, spin = Piece(2.0), Piece.spin(math.pi)
    turn_s = small.run_s(math.pi * small.spin_lever_m)
    assert small.seconds((ahead, spin, ahead)) == pytest.approx(2.0 * small.run_s(2.0) + turn_s)
    assert small.seconds((ahead, Piece(1.0, direction=-1))) == pytest.approx(small.run_s(2.0) + small.run_s(1.0))
    bend = Piece(1.0, 1.0)
    assert small.seconds((ahead, bend)) == pytest.approx(small.run_s(3.0) + small.bend_s_per_m)
