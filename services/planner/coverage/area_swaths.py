"""Areas as swaths: template segments that cover them and are planned like any other line."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from pydantic import ValidationError

from touchline.core.robust_overlay import buffer
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import ArcSpec, Area, LineSpec, Template, TemplateSegment
from touchline.services.planner.coverage.area_method import AreaMethod


def painted_segments(template: Template, width_m: float, method: AreaMethod) -> tuple[TemplateSegment, ...]:
    """Return all segments to paint: the template's own, followed by the swaths of its areas.

    Args:
        template: In the map frame.
        width_m: Working width of the tool (m).
        method: Area method that lays the swaths.

    Raises:
        PlanningError: An area is narrower than the tool everywhere, or the method has no usable swaths for it.
    """
    swaths = (swath for area in template.areas for swath in _swaths(area, width_m, method))
    return (*template.segments, *swaths)


def _swaths(area: Area, width_m: float, method: AreaMethod) -> Iterator[TemplateSegment]:
    if buffer(area.polygon, -0.5 * width_m).is_empty:
        problem = f'has the area "{area.id}", which is nowhere as wide as the tool ({width_m:g} m)'
        raise PlanningError("", problem, "enlarge it, or draw it as lines")
    curves: Sequence[Curve] = method(area, width_m)
    if not curves:
        raise PlanningError("", f'gets no swaths for the area "{area.id}"', "use another area method")
    for number, curve in enumerate(curves, 1):
        name, label = area.swath_id(number), f"{area.id}, swath {number}"
        try:
            yield TemplateSegment.model_validate({"id": name, "label": label, **_spec(curve)})
        except ValidationError as error:
            reason = error.errors()[0]["msg"].removeprefix("Value error, ")
            raise PlanningError(name, f"cannot be painted: {reason}", "use another area method") from error


def _spec(curve: Curve) -> dict[str, LineSpec | ArcSpec]:
    """Convert a curve to the specification of a template segment."""
    start = (curve.x_m, curve.y_m)
    if curve.curvature_1pm == 0.0:
        return {"line": LineSpec(start=start, end=curve.end[:2])}
    normal = np.array((-math.sin(curve.heading_rad), math.cos(curve.heading_rad)))
    x, y = (np.array(start) + normal / curve.curvature_1pm).tolist()
    return {"arc": ArcSpec(start=start, center=(x, y), sweep_angle=curve.curvature_1pm * curve.length_m)}
