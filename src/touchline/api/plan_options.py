"""Options of a plan, as Python gives them: None where a message has 0, "" or an empty array."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from touchline.schemas import messages
from touchline.schemas.spec import Spec

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Pose = tuple[float, float, float]


class PlanOptions(Spec):
    """Options of a plan; None is the default of vehicle and method."""

    method: str | None = None
    """Transitions between lines, or an area method."""
    area_method: str | None = None
    """Method for areas."""
    order: Literal["optimised", "given"] = "optimised"
    """Order of the lines: least time, or as in the template."""
    paint_speed_mps: Positive | None = None
    """Speed while marking or covering."""
    transit_speed_mps: Positive | None = None
    """Speed in transitions."""
    kappa_max_1pm: Positive | None = None
    """Largest curvature of turns."""
    sigma_max_1pm2: Positive | None = None
    """Largest change of curvature per metre."""
    start: Pose | None = None
    """Pose (m, m, rad, map frame) at which the robot begins; None: wherever that is quickest."""
    end: Pose | None = None
    """Pose at which it stops; None: behind the last line."""
    return_to_start: bool = False
    """True: it ends where it began."""
    forward_only: bool = False
    """True: it neither reverses nor turns on the spot."""
    drying_time_s: Positive | None = None
    """Time for which wet paint is avoided."""
    hard_drying: bool = False
    """True: there is no plan rather than one that drives over wet paint."""
    obstructed: Literal["leave-out", "refuse"] = "leave-out"
    """Treatment of obstructed stretches of lines: left out and reported, or there is no plan then."""
    overlap_m: NotNegative = 0.03
    """Areas: least overlap of neighbouring lanes."""
    margin_m: NotNegative = 0.05
    """Areas: clearance of the body from outlines, 40 % less in turns."""
    laps: Annotated[int, Field(ge=0)] | None = None
    """Areas: laps along the outline; None: as many as are needed."""
    swath_angle_deg: float | None = None
    """Areas: direction of the lanes, counter-clockwise from +x; None: the best one."""
    coverage_pct: Annotated[float, Field(ge=0, le=100)] | None = None
    """Areas: coverage of the reachable area until which misses are touched up; None: where that is cheap."""

    def message(self) -> messages.PlanOptions:
        """The options as the planner's request has them."""
        given = {name: value for name, value in self if value is not None}
        if self.swath_angle_deg is not None:
            given["swath_angle_deg"] = np.array([self.swath_angle_deg])
        return messages.PlanOptions.model_validate(given)
