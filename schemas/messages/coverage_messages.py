"""Areas that a tool covers, as planned and in truth."""

from typing import ClassVar

from touchline.schemas.messages.base import Message, UInt32
from touchline.schemas.messages.standard import Header


class MissedPatch(Message):
    """A place that a covering tool has left out: a point inside it and its size."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/MissedPatch"
    x_m: float = 0.0
    y_m: float = 0.0
    area_m2: float = 0.0


class AreaProgress(Message):
    """True coverage of the template's areas by a covering tool, counted in cells of a raster.

    ``overlap_m2`` was passed over more than once; ``cell_m`` is the edge of a cell.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/AreaProgress"
    header: Header = Header()
    area_m2: float = 0.0
    covered_m2: float = 0.0
    coverage_pct: float = 0.0
    overlap_m2: float = 0.0
    cell_m: float = 0.0


class AreaReport(Message):
    """The template's areas after a traversal with a covering tool, exact on polygons and against the truth.

    Percentages are of the areas, of what of them the tool can reach with the body inside the boundary and off obstacles
    (``reachable_m2``), and of what of them the plan would cover (``planned_m2``). ``missed`` are the larger patches
    that were left out, ``missed_m2`` is all that was. ``body_outside_m`` is how far the body got beyond the boundary or
    into an obstacle at most. Lateral errors are the tool's against the planned path.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/AreaReport"
    header: Header = Header()
    area_m2: float = 0.0
    covered_m2: float = 0.0
    coverage_pct: float = 0.0
    reachable_m2: float = 0.0
    of_reachable_pct: float = 0.0
    planned_m2: float = 0.0
    of_planned_pct: float = 0.0
    overlap_m2: float = 0.0
    missed_m2: float = 0.0
    body_outside_m: float = 0.0
    lateral_error_mean_m: float = 0.0
    lateral_error_p95_m: float = 0.0
    lateral_error_max_m: float = 0.0
    missed: tuple[MissedPatch, ...] = ()


class PlannedCoverage(Message):
    """Coverage of areas by a plan, from the exact sweep of the drum or tool along it.

    ``reachable_m2`` is what the tool could get to with the body off boundary and obstacles by the margin, and
    ``reachable_pct`` how much of that is covered. ``overlap_m2`` is covered more than once; ``body_outside_m`` is how
    far the body leaves the boundary or enters an obstacle at most, negative: how far it keeps off.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PlannedCoverage"
    method: str = ""
    area_m2: float = 0.0
    covered_m2: float = 0.0
    coverage_pct: float = 0.0
    reachable_m2: float = 0.0
    reachable_pct: float = 0.0
    overlap_m2: float = 0.0
    body_outside_m: float = 0.0
    lanes: UInt32 = 0
    laps: UInt32 = 0
    swath_angle_deg: float = 0.0
    notes: tuple[str, ...] = ()
    missed: tuple[MissedPatch, ...] = ()
