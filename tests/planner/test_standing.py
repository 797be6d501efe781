"""Cusps and turns on the spot: planned only for robots that can, sent and reported as they are driven."""

import math
from itertools import pairwise

import numpy as np
import pytest

from tests.planner.drawn import drawn
from touchline.schemas.messages import CurveType, LinearDirection, PlanOptions, VelocityType
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.segments.sections import runs

AGILE = Vehicle(
    drive={"can_reverse": True, "can_spin": True, "max_acceleration_mps2": 3.0}, tool={"paint_speed_mps": 0.5}
)
SPINNING = AGILE.changed(drive={"can_reverse": False})
REVERSING = AGILE.changed(drive={"can_spin": False})


def comb() -> Template:
    """Short lines side by side, with no room to turn between them."""
    return drawn(*((0.0, 0.3 * k, 4.0, 0.3 * k) for k in range(4)))


def there_and_back() -> Template:
    """Two lines, the second painted on the way back along the robot's own track."""
    left = -2.0 * AGILE.tool.nozzle_y_m
    return drawn((0.0, 0.0, 4.0, 0.0), (4.0, left, 0.0, left))


def check(planned: Plan) -> None:
    report = planned.report
    assert report.position_gap_m < 1e-9
    assert report.heading_gap_rad < 1e-9
    assert max(each.max_rate for each in report.actuators) <= AGILE.drive.max_wheel_acceleration_radps2
    for station in stops(planned):
        assert float(planned.speeds.speed_at(station)) == pytest.approx(0.0, abs=1e-6)


def stops(planned: Plan) -> list[float]:
    return [b.start_m for a, b in pairwise(planned.sent) if a.direction != b.direction or b.spin_rad]


def test_a_robot_that_can_only_go_forward_is_sent_no_standstill() -> None:
    planned = plan(comb(), Vehicle(drive={"can_reverse": False, "can_spin": False}))
    assert (planned.report.cusps, planned.report.spins) == (0, 0)
    assert {s.direction.value for s in planned.trajectory.path.segments} == {LinearDirection.FORWARD}
    assert planned.trajectory == plan(comb(), Vehicle(), PlanOptions(forward_only=True)).trajectory


@pytest.mark.parametrize(("vehicle", "template"), [(AGILE, comb()), (SPINNING, there_and_back()), (REVERSING, comb())])
def test_standing_still_saves_time_where_there_is_no_room(vehicle: Vehicle, template: Template) -> None:
    planned = plan(template, vehicle, PlanOptions(order="given"))
    forward = plan(template, vehicle, PlanOptions(order="given", forward_only=True))
    check(planned)
    assert planned.report.cusps + planned.report.spins > 0
    assert planned.report.total_time_s < forward.report.total_time_s
    if not vehicle.drive.can_spin:
        assert planned.report.spins == 0
    if not vehicle.drive.can_reverse:
        assert LinearDirection.BACKWARD not in {s.direction.value for s in planned.trajectory.path.segments}


def test_a_turn_on_the_spot_is_an_arc_without_radius_at_an_angular_velocity() -> None:
    planned = plan(there_and_back(), SPINNING, PlanOptions(order="given"))
    spins = [s for s in planned.trajectory.path.segments if s.direction.value == LinearDirection.NONE]
    assert len(spins) == planned.report.spins > 0
    for segment in spins:
        assert segment.curve.type.value == CurveType.ARC
        assert segment.curve.arc[0].start == segment.curve.arc[0].center
    entries = planned.trajectory.velocity_profile.parameters
    angular = [p for p in entries if p.velocity.type.value == VelocityType.ANGULAR]
    assert [p.velocity.value > 0 for p in angular] == [s.curve.arc[0].sweep_angle > 0 for s in spins]
    assert [p.arc_length for p in entries] == sorted(p.arc_length for p in entries)
    assert planned.speeds.dwell_s.sum() == pytest.approx(sum(s.seconds for s in planned.speeds.spins))


def test_runs_are_the_curves_that_are_travelled() -> None:
    path = PiecePath(
        PathPose(1.0, 2.0, 0.3),
        (
            Piece(1.0, 0.0, 0.5),
            Piece(2.0, 0.5, -0.4, -1),
            Piece.spin(1.2),
            Piece(0.7, 0.0, 1.0),
            Piece(1.0, 0.2, 0.0, -1),
        ),
    )
    parts = runs(path)
    assert [(r.direction, r.spin_rad) for r in parts] == [(1, 0.0), (-1, 0.0), (1, 1.2), (-1, 0.0)]
    at = 0.0
    for run in parts:
        length = run.path.length_m
        inside = np.linspace(0.0, length, 7)[1:-1]
        x, y, heading, _ = path.sample(at + inside)
        u, v, travelling, _ = run.path.sample(inside)
        assert np.allclose(x, u)
        assert np.allclose(y, v)
        assert np.allclose(np.exp(1j * heading) * run.direction, np.exp(1j * travelling))
        at += length
    assert parts[-1].path.end.heading_rad == pytest.approx(path.end.heading_rad + math.pi)
