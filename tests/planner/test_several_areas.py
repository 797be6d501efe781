"""Several areas of one template, covered one after the other by a roller, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest

from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.services.planner.plan import plan
from touchline.services.planner.plan_task import Company

EASY = PlanOptions(coverage_pct=60.0)
FORWARD = PlanOptions(coverage_pct=60.0, forward_only=True)


def box(left: float, low: float, right: float, high: float) -> list[tuple[float, float]]:
    return [(left, low), (right, low), (right, high), (left, high)]


def template(**parts: Any) -> Template:
    areas = [{"id": "west", "outline": box(0, 0, 20, 14)}, {"id": "east", "outline": box(24, 0, 44, 14)}]
    return Template.model_validate({"name": "two", "title": "Two", "areas": areas, **parts})


WALLED = pytest.param({"boundary": {"corners": box(0, 0, 44, 14)}}, EASY, marks=pytest.mark.full)


@pytest.mark.parametrize(("parts", "options"), [({}, FORWARD), WALLED])
def test_areas_are_covered_in_turn_on_one_way_without_a_gap(parts: dict[str, Any], options: PlanOptions) -> None:
    planned = plan(template(**parts), load_vehicle("clay-roller"), options)
    assert len(planned.report.coverage) == 2
    assert all(figures.reachable_pct >= EASY.coverage_pct for figures in planned.report.coverage)
    assert all(figures.body_outside_m <= 0.0 for figures in planned.report.coverage)
    for before, after in zip(planned.sections, planned.sections[1:], strict=False):
        assert abs(before.path.end.point - after.path.start.point) < 1e-6
        turned = after.path.start.heading_rad - before.path.end.heading_rad
        assert abs(math.remainder(turned, math.tau)) < 1e-6
    swaths = [section.swath_id.partition("#")[0] for section in planned.sections if section.swath_id]
    assert swaths == sorted(swaths, reverse=True), "west comes first and is done before east begins"


def test_a_machine_that_stands_in_another_area_sets_out_from_there() -> None:
    two, roller = template(), load_vehicle("clay-roller")
    east = Company(grounds={"east": two.areas[1].polygon})
    planned = plan(two, roller, FORWARD.model_copy(update={"start": np.array((8.0, 7.0, 0.0))}), company=east)
    assert planned.sections[0].path.start == pytest.approx((8.0, 7.0, 0.0))
    for before, after in zip(planned.sections, planned.sections[1:], strict=False):
        assert abs(before.path.end.point - after.path.start.point) < 1e-6
    assert [figures.reachable_pct >= EASY.coverage_pct for figures in planned.report.coverage] == [True]


@pytest.mark.full
def test_the_area_in_which_the_machine_stands_comes_first() -> None:
    two, roller = template(), load_vehicle("clay-roller")
    both = plan(two, roller, FORWARD.model_copy(update={"start": np.array((30.0, 7.0, 0.0))}))
    swaths = [section.swath_id.partition("#")[0] for section in both.sections if section.swath_id]
    assert swaths == sorted(swaths), "east comes first, as the machine stands there"


def test_areas_with_a_wall_between_are_refused_with_the_remedy() -> None:
    parts = {
        "boundary": {"corners": box(-1, -1, 45, 15)},
        "obstacles": [{"id": "wall", "corners": box(21.5, -2, 22.5, 16)}],
    }
    with pytest.raises(PlanningError, match=r'no path.*"west".*"east".*template of its own'):
        plan(template(**parts), load_vehicle("clay-roller"), FORWARD)


def test_an_area_without_room_is_named() -> None:
    small = Template.model_validate({"name": "s", "title": "S", "areas": [{"id": "yard", "outline": box(0, 0, 9, 2)}]})
    with pytest.raises(PlanningError, match=r'no room for a single straight \(area "yard"\); enlarge'):
        plan(small, load_vehicle("clay-roller"))


def test_planning_ends_when_progress_raises() -> None:
    told: list[float] = []

    def tell(stage: str, done: float) -> None:
        told.append(done)
        if stage == "covering" and done > 0.2:
            raise TimeoutError

    with pytest.raises(TimeoutError):
        plan(template(), load_vehicle("clay-roller"), FORWARD, tell)
    assert len(told) > 3
    assert np.all(np.diff(told) >= 0.0)
