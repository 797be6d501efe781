"""Warm-up of the planner: small plans of every kind, which compile its kernels or load them from the cache."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from typing import Any, Final

import numpy as np

from touchline.core.compilations import Step
from touchline.schemas.known_ground import KnownGround, KnownObstacle
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PlanRequest, PoseGoal, WaySearch
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.services.planner.coverage.kernels.lane_anneal import LaneCosts, annealed
from touchline.services.planner.request import answer
from touchline.services.planner.steering.word_lengths import word_lengths

_CROSSING: Final = {"a": ((0, 0), (2, 0)), "b": ((0, 3), (2, 3)), "c": ((1, -1), (1, 4))}
_APART: Final = {"a": ((0, 0), (2, 0)), "b": ((20, 0), (22, 0))}
_BETWEEN: Final = {"id": "post", "corners": [(10, -1), (11, -1), (11, 1), (10, 1)]}
_FAR: Final = PoseGoal(x_m=8.0, y_m=3.0)
_TURNED: Final = PoseGoal(x_m=8.0, y_m=3.0, heading_rad=1.0)


def planner_steps(vehicle: Vehicle) -> Iterator[Step]:
    """Steps of the warm-up for one vehicle; plans that it cannot do are refused, and need no kernels.

    Args:
        vehicle: Vehicle of any kind.
    """
    yield "lines", partial(_plan_all, _line_requests(), vehicle)
    yield "detours", _detour
    if vehicle.tool.width_m > 0.0:
        yield "areas", partial(_plan_all, _area_requests(vehicle), vehicle)
    if vehicle.tool.covers:
        yield "lanes", _order_lanes
    yield "goals", partial(_plan_all, _goal_requests(), vehicle)
    yield "goals from amid a drive", partial(_leave, vehicle)
    if any(isinstance(each, LidarSpec) for each in vehicle.sensors):
        yield "goals round things", partial(_go_round, vehicle)


def _plan_all(requests: list[PlanRequest], vehicle: Vehicle) -> None:
    for request in requests:
        answer(request, vehicle)


def _line_requests() -> list[PlanRequest]:
    options = [PlanOptions(), PlanOptions(order="given"), PlanOptions(method="dubins-padded")]
    crossing = [PlanRequest(template_json=_lines(_CROSSING), options=chosen) for chosen in options]
    # One of these is enough: ways round obstacles are looked for alike whatever the options are, which takes longest.
    return [*crossing, PlanRequest(template_json=_lines(_APART, obstacles=[_BETWEEN]))]


def _detour() -> None:
    word_lengths(np.zeros((1, 4)), np.ones((1, 4)), 1.0, 1.0)


def _order_lanes() -> None:
    pairs = np.zeros((0, 3), dtype=np.int64)
    annealed(np.array([0, 2]), LaneCosts(np.zeros((4, 4)), np.zeros(4), np.zeros(2), pairs, 0.0), 1, 1.0, 0)


def _area_requests(vehicle: Vehicle) -> list[PlanRequest]:
    side_m = 2.5 * vehicle.tool.width_m
    area = {"id": "area", "outline": _square(0.0, side_m)}
    template = json.dumps({"name": "warm-up", "areas": [area]})
    return [PlanRequest(template_json=template, options=PlanOptions(area_method=name)) for name in ("", "parallel")]


def _goal_requests() -> list[PlanRequest]:
    from_rest = PlanOptions(start=np.zeros(3))
    variants: list[dict[str, Any]] = [
        {},
        {"law": "quintic"},
        {"method": "cubic"},
        {"method": "cubic", "tangents_m": np.array([4.0, 4.0])},
        {"method": "turn-line-turn"},
    ]
    return [PlanRequest(goal=(_TURNED.model_copy(update=variant),), options=from_rest) for variant in variants]


def _leave(vehicle: Vehicle) -> None:
    """Plan from amid the drive to a goal."""
    drive = answer(PlanRequest(goal=(_FAR,), options=PlanOptions(start=np.zeros(3))), vehicle).trajectory
    answer(PlanRequest(goal=(_FAR,), leaving=(LeavingTrajectory(trajectory=drive),)), vehicle)


def _go_round(vehicle: Vehicle) -> None:
    """Plan over known ground, as a robot that goes round what it sees asks: from rest, and from amid a drive."""
    post = KnownObstacle(id="post", corners=((3.5, -0.5), (4.5, -0.5), (4.5, 3.0), (3.5, 3.0)))
    ground = KnownGround(boundary=tuple(_square(-10.0, 20.0)), obstacles=(post,))
    asked = PlanRequest(goal=(_FAR,), ground_json=ground.model_dump_json(), search=WaySearch(quick=True))
    from_rest = {"options": PlanOptions(start=np.zeros(3))}
    drive = answer(asked.model_copy(update=from_rest), vehicle).trajectory
    answer(asked.model_copy(update={"leaving": (LeavingTrajectory(trajectory=drive, keep_s=0.5),)}), vehicle)


def _lines(ends: dict[str, Any], **more: Any) -> str:
    segments = [{"id": name, "line": {"start": start, "end": end}} for name, (start, end) in ends.items()]
    return json.dumps({"name": "warm-up", "segments": segments, **more})


def _square(low_m: float, high_m: float) -> list[tuple[float, float]]:
    return [(low_m, low_m), (high_m, low_m), (high_m, high_m), (low_m, high_m)]
