"""Checks of what area methods of plug-ins return."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import shapely

from touchline.schemas.curves import Curve
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS
from touchline.schemas.template import Area
from touchline.schemas.vehicles import ToolSpec
from touchline.services.planner.coverage.area_method import AreaMethod, CoverageMethod, area_method_name, area_method_of
from touchline.services.planner.coverage.coverage_route import CoverageRoute
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.plugin_answers import Blame, blaming, called, leading, sound


def guarded_area_method(options: PlanOptions, tool: ToolSpec) -> AreaMethod | CoverageMethod:
    """Return the area method that the options name; a plug-in's is wrapped in checks of what it returns.

    Raises:
        PlanningError: There is no such method, it is for other tools, or it is no method. The checks raise it, too.
    """
    method = area_method_of(options, tool)
    blame = blaming(AREA_METHODS, area_method_name(options, tool))
    if blame is None:
        return method
    return _guarded_coverage(method, blame) if isinstance(method, CoverageMethod) else _guarded_area(method, blame)


def _guarded_area(method: Any, blame: Blame) -> Callable[[Area, float], Sequence[Curve]]:
    if not callable(method):
        raise blame(f"it is {method!r}, neither a function nor a CoverageMethod")

    def swaths(area: Area, width_m: float) -> Sequence[Curve]:
        found = called(blame, method, area, width_m)
        if not isinstance(found, Iterable):
            raise blame(f'it gave a {type(found).__name__} instead of lines and arcs for the area "{area.id}"')
        curves = list(found)
        around = shapely.Polygon(area.polygon.exterior).buffer(width_m, join_style="mitre")
        for number, curve in enumerate(curves, 1):
            if not isinstance(curve, Curve):
                raise blame(f'it gave a {type(curve).__name__} instead of a line or arc for the area "{area.id}"')
            numbers = (curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m)
            if not (all(map(math.isfinite, numbers)) and curve.length_m > 0.0):
                raise blame(f'swath {number} of the area "{area.id}" is {numbers}')
            x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, 33))
            if not bool(shapely.covers(around, shapely.points(x, y)).all()):
                raise blame(f'swath {number} leads out of the area "{area.id}"')
        return curves

    return swaths


def _guarded_coverage(method: CoverageMethod, blame: Blame) -> CoverageMethod:
    def cover(task: CoverageTask, progress: Callable[[float], None]) -> CoverageRoute:
        route = called(blame, method.cover, task, progress)
        if not isinstance(route, CoverageRoute):
            raise blame(f"it gave a {type(route).__name__} instead of a CoverageRoute")
        at: PathPose | None = None
        for piece in route.pieces:
            start = at or piece.path.start
            leading((), start, piece.path.start, blame)
            sound(piece.path.pieces, blame)
            if not piece.path.pieces or len({part.direction for part in piece.path.pieces}) > 1:
                raise blame(f"its {piece.label} is not driven in one direction")
            at = piece.path.end
        return route

    return CoverageMethod(cover)
