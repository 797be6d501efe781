"""Requests to the planner, and its answers."""

import math
from typing import Annotated, ClassVar

from pydantic import Field

from touchline.schemas.given_angles import AngleOrAny
from touchline.schemas.messages.base import Float64Array, Int32, Message, UInt32, zeros
from touchline.schemas.messages.coverage_messages import PlannedCoverage
from touchline.schemas.messages.turf_tank import Trajectory


class PlanOptions(Message):
    """Options of a plan; 0, empty text and an empty ``start`` mean the vehicle's default.

    ``start`` is empty or (x m, y m, heading rad) in the map frame. ``order`` is "optimised" (also if empty) or "given".
    Curvature and sharpness of 0 leave both to the wheels' dynamics, point by point. Wet paint is kept off
    ``drying_time_s`` long: at the cost of some time, or, if ``hard_drying``, without exception. The robot stops behind
    the last line, at the pose ``end`` if that is given, or, if it shall ``return_to_start``, where it began.

    Areas are covered by ``area_method``; ``method`` may name one, too. A coverage method lets lanes overlap by
    ``overlap_m`` at least, keeps the body ``margin_m`` off boundary and obstacles, drives ``laps`` laps along the
    outline (-1: as many as it needs) and lanes in the direction ``swath_angle_deg`` (empty: the area's, or which suits
    best), and goes on touching up until it covers ``coverage_pct`` of what can be reached (0: what is cheap).

    Plans of lines keep farther off obstacles if the vehicle has a lidar, so that its protection lets it drive; with a
    ``margin_m`` of 0 they do not, as the obstacles have that clearance already.

    Stretches of lines along which the body would touch an outline are left out and reported; with ``obstructed``
    "refuse" there is no plan then.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PlanOptions"
    method: str = ""
    kappa_max_1pm: float = 0.0
    sigma_max_1pm2: float = 0.0
    paint_speed_mps: float = 0.0
    transit_speed_mps: float = 0.0
    start: Annotated[Float64Array, Field(max_length=3)] = zeros(0)
    order: str = ""
    forward_only: bool = False
    drying_time_s: float = 0.0
    hard_drying: bool = False
    return_to_start: bool = False
    end: Annotated[Float64Array, Field(max_length=3)] = zeros(0)
    area_method: str = ""
    overlap_m: float = 0.03
    margin_m: float = 0.05
    laps: Int32 = -1
    swath_angle_deg: Annotated[Float64Array, Field(max_length=1)] = zeros(0)
    coverage_pct: float = 0.0
    obstructed: str = ""


class LeftOutStretch(Message):
    """A stretch of a line that a plan leaves out, as the body would touch an outline there.

    It lies ``from_m`` to ``to_m`` along the line of the template, or swath of an area, that ``line_id`` names.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/LeftOutStretch"
    line_id: str = ""
    outline: str = ""
    from_m: float = 0.0
    to_m: float = 0.0
    from_x_m: float = 0.0
    from_y_m: float = 0.0
    to_x_m: float = 0.0
    to_y_m: float = 0.0

    @property
    def length_m(self) -> float:
        """Length of the line that is left out."""
        return self.to_m - self.from_m

    @property
    def words(self) -> str:
        """Length, line, place and reason as text."""
        from_, to = f"({self.from_x_m:.2f}, {self.from_y_m:.2f})", f"({self.to_x_m:.2f}, {self.to_y_m:.2f})"
        return f'{self.length_m:.2f} m of "{self.line_id}" from {from_} to {to}, beside "{self.outline}"'


class PoseGoal(Message):
    """A pose to drive to, in the map frame; heading NaN: any.

    ``method`` and ``law`` name a pose method and a speed law; empty text means the default. ``tangents_m`` are the
    lengths k of the cubic method at start and goal, one for both, or none: they are chosen. It is reached after
    ``duration_s``, or, if that is 0, as soon as the law allows.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PoseGoal"
    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: AngleOrAny = math.nan
    method: str = ""
    tangents_m: Annotated[Float64Array, Field(max_length=2)] = zeros(0)
    law: str = ""
    duration_s: float = 0.0


class LeavingTrajectory(Message):
    """The trajectory that a driving robot is to leave, and the arc length that it has come to.

    It is kept as it is for ``keep_s`` (0: 2 s) from there: so long planning, sending and taking over may take.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/LeavingTrajectory"
    trajectory: Trajectory = Trajectory()
    arc_length_m: float = 0.0
    keep_s: float = 0.0


class WaySearch(Message):
    """Extent of the search for a way over known ground.

    With ``no_reversing`` the vehicle does not drive backward. A ``quick`` search looks at roadmaps alone: it misses
    some ways, and proves nothing. Where start or goal lie nearer to things than the margin, that is reduced to
    ``spare_share`` of the distance (0: a half).
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/WaySearch"
    no_reversing: bool = False
    quick: bool = False
    spare_share: float = 0.0


class ActuatorExtremes(Message):
    """The most that a plan asks of an actuator: of its ``quantity``, in ``unit``, and of how fast that changes.

    ``max_rate`` is per second, and infinite where curvature steps.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/ActuatorExtremes"
    name: str = ""
    quantity: str = ""
    unit: str = ""
    max: float = 0.0
    max_rate: float = 0.0


class PlanReport(Message):
    """The figures of a plan, as it is sent to the robot.

    ``max_curvature_step_1pm`` is the largest step of curvature from one line or arc to the next; ``wet_crossings``
    counts how often a wheel or caster meets paint that is not dry yet, ``wet_crossings_unavoidable`` those of them that
    no other order or direction of painting would do away with. ``coverage`` has an entry for each area,
    ``left_out`` one for each stretch of a line that something is in the way of.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PlanReport"
    paint_length_m: float = 0.0
    transition_length_m: float = 0.0
    total_length_m: float = 0.0
    paint_time_s: float = 0.0
    transition_time_s: float = 0.0
    total_time_s: float = 0.0
    painted_segments: UInt32 = 0
    transitions: UInt32 = 0
    max_curvature_1pm: float = 0.0
    max_sharpness_1pm2: float = 0.0
    actuators: tuple[ActuatorExtremes, ...] = ()
    position_gap_m: float = 0.0
    heading_gap_rad: float = 0.0
    planning_time_s: float = 0.0
    max_curvature_step_1pm: float = 0.0
    max_lateral_acceleration_mps2: float = 0.0
    cusps: UInt32 = 0
    spins: UInt32 = 0
    wet_crossings: UInt32 = 0
    wet_crossings_unavoidable: UInt32 = 0
    paint_l: float = 0.0
    battery_wh: float = 0.0
    coverage: tuple[PlannedCoverage, ...] = ()
    left_out: tuple[LeftOutStretch, ...] = ()


class PlanRequest(Message):
    """Plan a template for a vehicle, both given as their JSON text; no vehicle: the planner's own.

    With a ``goal`` there is no template: the vehicle drives there from the ``start`` of the options, or, with
    ``leaving``, from amid another drive, whose next stretch the plan begins with. On the way the body keeps the
    options' ``margin_m`` off what ``ground_json`` tells (``touchline.schemas.known_ground``; empty: nothing is known).
    Where that is in the way, another one is looked for to the extent of ``search``.

    A tool that covers is planned for the pieces of the template's areas in ``remaining_json``
    (``touchline.schemas.ground_piece``; empty: all of every area).
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Plan_Request"
    request_id: str = ""
    template_json: str = ""
    vehicle_json: str = ""
    options: PlanOptions = PlanOptions()
    goal: Annotated[tuple[PoseGoal, ...], Field(max_length=1)] = ()
    leaving: Annotated[tuple[LeavingTrajectory, ...], Field(max_length=1)] = ()
    ground_json: str = ""
    remaining_json: str = ""
    search: WaySearch = WaySearch()


class PlanResponse(Message):
    """The plan, or the reason why there is none.

    ``nothing_reached``: no line of the template is within reach where things stand.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Plan_Response"
    success: bool = False
    message: str = ""
    nothing_reached: bool = False
    trajectory: Trajectory = Trajectory()
    report: PlanReport = PlanReport()
