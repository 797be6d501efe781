"""Touchline's own messages, for what no standard type covers."""

from typing import Annotated, ClassVar

from pydantic import Field

from touchline.schemas.messages.base import Float64Array, Int32, Message, UInt8, UInt32, UInt64, zeros
from touchline.schemas.messages.standard import DiagnosticArray, Header
from touchline.schemas.messages.turf_tank import Trajectory


class ActuatorCommand(Message):
    """What the drive's actuators are told: of each ``names`` one of ``values``, in rad/s or rad as its drive says."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/ActuatorCommand"
    header: Header = Header()
    names: tuple[str, ...] = ()
    values: Float64Array = zeros(0)


class GnssStatus(Message):
    """What NavSatFix cannot say: the RTK state of the fix."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/GnssStatus"
    NONE: ClassVar[int] = 0
    SINGLE: ClassVar[int] = 1
    FLOAT: ClassVar[int] = 2
    FIXED: ClassVar[int] = 3
    header: Header = Header()
    fix: Annotated[UInt8, Field(le=3)] = 0
    satellites: UInt8 = 0
    correction_age_s: float = 0.0
    horizontal_accuracy_m: float = 0.0


class EstimatorStatus(Message):
    """How consistent the robot's estimator is: innovations, normalised squares (NIS) and what was not used.

    A consistent estimator has a mean NIS of the measurement's dimension: 2 for fixes and wheels, 1 for the
    magnetometer. Counts and means are since the estimator was last started.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/EstimatorStatus"
    header: Header = Header()
    innovation_east_m: float = 0.0
    innovation_north_m: float = 0.0
    fix_nis: float = 0.0
    fix_nis_recent: float = 0.0
    fix_nis_mean: float = 0.0
    encoder_nis_mean: float = 0.0
    magnetometer_nis_mean: float = 0.0
    position_sigma_m: float = 0.0
    heading_sigma_rad: float = 0.0
    wheel_slip: float = 0.0
    fixes: UInt32 = 0
    fixes_rejected: UInt32 = 0
    fixes_too_late: UInt32 = 0
    fixes_duplicate: UInt32 = 0
    fixes_out_of_order: UInt32 = 0
    gyro_rejected: UInt32 = 0
    encoders_rejected: UInt32 = 0
    magnetometer_rejected: UInt32 = 0
    recoveries: UInt32 = 0


class SprayerState(Message):
    """Valve, disc and tank; commanded against actual."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/SprayerState"
    header: Header = Header()
    valve_commanded: bool = False
    valve_open: bool = False
    disc_commanded: bool = False
    disc_down: bool = False
    flow_lps: float = 0.0
    tank_l: float = 0.0


class PaintMarks(Message):
    """A stretch of one painted stroke: the nozzle's true positions in the map frame.

    The last point of a batch is the first of the next one of the same stroke. ``first_index`` counts the points of
    the session, so that a receiver sees what it missed.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PaintMarks"
    header: Header = Header()
    segment_id: str = ""
    first_index: UInt32 = 0
    width_m: float = 0.0
    x_m: Float64Array = zeros(0)
    y_m: Float64Array = zeros(0)


class TraversalStatus(Message):
    """Where the traversal stands, as the robot believes; ``TrueCoverage`` has the truth.

    ``painted_ids`` are the path's sprayed segments, ``painted_fraction`` is the share of each, in that order, along
    which the valve was open by the robot's own progress, and ``coverage_pct`` that of all of them. ``lateral_error_m``
    is the estimated nozzle's distance to the left of its path; ``spraying``: the valve is commanded open.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TraversalStatus"
    IDLE: ClassVar[int] = 0
    READY: ClassVar[int] = 1
    RUNNING: ClassVar[int] = 2
    PAUSED: ClassVar[int] = 3
    DONE: ClassVar[int] = 4
    ABORTED: ClassVar[int] = 5
    ESTOPPED: ClassVar[int] = 6
    header: Header = Header()
    state: Annotated[UInt8, Field(le=6)] = 0
    reason: str = ""
    segment_index: UInt32 = 0
    segment_count: UInt32 = 0
    segment_id: str = ""
    arc_length_m: float = 0.0
    total_length_m: float = 0.0
    coverage_pct: float = 0.0
    painted_ids: tuple[str, ...] = ()
    painted_fraction: Float64Array = zeros(0)
    speed_mps: float = 0.0
    elapsed_s: float = 0.0
    remaining_s: float = 0.0
    lateral_error_m: float = 0.0
    spraying: bool = False


class TrueCoverage(Message):
    """What has really been painted, which only an emulator can know.

    ``painted_ids`` are the template's lines, or, without a template, the path's sprayed segments; ``painted_fraction``
    is the share of each over which paint lies, in that order, and ``coverage_pct`` that of all of them. Of a covering
    tool they are the template's areas, and the shares those that it has been over.
    ``lateral_error_m`` is the distance of the last paint to the left of its line; ``flowing``: paint leaves the nozzle.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TrueCoverage"
    header: Header = Header()
    coverage_pct: float = 0.0
    painted_ids: tuple[str, ...] = ()
    painted_fraction: Float64Array = zeros(0)
    lateral_error_m: float = 0.0
    flowing: bool = False


class SegmentPaint(Message):
    """One line of the template, as it was painted; ``width_m`` is the mean width of its paint, 0 without any.

    Shares are of its length (``coverage_pct``), of its area (``area_coverage_pct``), and of its length with the middle
    of the paint within the template's tolerance (``within_tolerance_pct``).
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/SegmentPaint"
    id: str = ""
    length_m: float = 0.0
    coverage_pct: float = 0.0
    area_coverage_pct: float = 0.0
    within_tolerance_pct: float = 0.0
    gap_m: float = 0.0
    width_m: float = 0.0
    overspray_m2: float = 0.0
    double_paint_m2: float = 0.0
    lateral_error_mean_m: float = 0.0
    lateral_error_p95_m: float = 0.0
    lateral_error_max_m: float = 0.0


class Smear(Message):
    """A print of a wheel or caster that has rolled over wet paint: the middle of its tread in the map frame.

    ``segment_id`` is the line whose paint it is, ``age_s`` how old that was then, ``strength`` the share of a fresh
    line's paint that is left here.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/Smear"
    segment_id: str = ""
    age_s: float = 0.0
    strength: float = 0.0
    width_m: float = 0.0
    x_m: Float64Array = zeros(0)
    y_m: Float64Array = zeros(0)


class AreaProgress(Message):
    """How much of the template's areas a covering tool has really been over, counted in cells of a raster.

    ``overlap_m2`` was passed over more than once; ``cell_m`` is the edge of a cell.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/AreaProgress"
    header: Header = Header()
    area_m2: float = 0.0
    covered_m2: float = 0.0
    coverage_pct: float = 0.0
    overlap_m2: float = 0.0
    cell_m: float = 0.0


class MissedPatch(Message):
    """A place that a covering tool has left out: a point inside it and its size."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/MissedPatch"
    x_m: float = 0.0
    y_m: float = 0.0
    area_m2: float = 0.0


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


class TraversalReport(Message):
    """The figures of a finished traversal: the emulator's evaluation against the truth, not the robot's own.

    Errors are the true nozzle's against the template.
    ``success``: it got to its end, and the paint is accepted. ``paint_accepted`` is decided by ``tolerance_m``;
    ``verdict`` says in words with what margin. ``wet_crossings`` counts how often a wheel or caster met wet paint,
    ``wet_youngest_s`` is the age of the freshest (0 without any). ``session_hash`` is that of every recorded payload
    since the load, this one with an empty hash included.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TraversalReport"
    header: Header = Header()
    success: bool = False
    total_time_s: float = 0.0
    coverage_pct: float = 0.0
    area_coverage_pct: float = 0.0
    tolerance_m: float = 0.0
    within_tolerance_pct: float = 0.0
    paint_accepted: bool = False
    verdict: str = ""
    gap_m: float = 0.0
    overspray_m2: float = 0.0
    double_paint_m2: float = 0.0
    lateral_error_mean_m: float = 0.0
    lateral_error_p95_m: float = 0.0
    lateral_error_max_m: float = 0.0
    position_rmse_m: float = 0.0
    heading_rmse_rad: float = 0.0
    painted_length_m: float = 0.0
    template_length_m: float = 0.0
    follower_fallbacks: UInt32 = 0
    wet_crossings: UInt32 = 0
    wet_youngest_s: float = 0.0
    smeared_m2: float = 0.0
    smears: tuple[Smear, ...] = ()
    segments: tuple[SegmentPaint, ...] = ()
    session_hash: str = ""


class Event(Message):
    """Something an operator should know."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/Event"
    INFO: ClassVar[int] = 0
    WARN: ClassVar[int] = 1
    ERROR: ClassVar[int] = 2
    header: Header = Header()
    severity: Annotated[UInt8, Field(le=2)] = 0
    source: str = ""
    code: str = ""
    text: str = ""


class Progress(Message):
    """How far a long request has come; ``fraction`` is 0…1."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/Progress"
    request_id: str = ""
    stage: str = ""
    fraction: float = 0.0


class PlanOptions(Message):
    """How to plan; 0, empty text and an empty ``start`` mean the vehicle's default.

    ``start`` is empty or (x m, y m, heading rad) in the map frame. ``order`` is "optimised" (also if empty) or "given".
    Curvature and sharpness of 0 leave both to the wheels' dynamics, point by point. Wet paint is kept off
    ``drying_time_s`` long: at the cost of some time, or, if ``hard_drying``, without exception. The robot stops behind
    the last line, at the pose ``end`` if that is given, or, if it shall ``return_to_start``, where it began.

    Areas are covered by ``area_method``; ``method`` may name one, too. A coverage method lets lanes overlap by
    ``overlap_m`` at least, keeps the body ``margin_m`` off boundary and obstacles, drives ``laps`` laps along the
    outline (-1: as many as it needs) and lanes in the direction ``swath_angle_deg`` (empty: the area's, or which suits
    best), and goes on touching up until it covers ``coverage_pct`` of what can be reached (0: what is cheap).
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


class PlannedCoverage(Message):
    """How a plan covers areas, by the drum's or the tool's exact sweep along it.

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
    no other order or direction of painting would do away with. ``coverage`` is empty unless a coverage method planned.
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


class PlanRequest(Message):
    """Plan a template for a vehicle, both given as their JSON text; no vehicle: the planner's own."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Plan_Request"
    request_id: str = ""
    template_json: str = ""
    vehicle_json: str = ""
    options: PlanOptions = PlanOptions()


class PlanResponse(Message):
    """The plan, or the reason why there is none."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Plan_Response"
    success: bool = False
    message: str = ""
    trajectory: Trajectory = Trajectory()
    report: PlanReport = PlanReport()


class LoadRequest(Message):
    """Load a trajectory; with the template (JSON text, may be empty) paint is judged against it.

    ``resume``: go on where the robot was in this very trajectory when its process died.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Load_Request"
    request_id: str = ""
    trajectory: Trajectory = Trajectory()
    template_json: str = ""
    resume: bool = False


class LoadResponse(Message):
    """Whether the trajectory was taken; ``total_time`` in seconds."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Load_Response"
    success: bool = False
    message: str = ""
    total_time: float = 0.0


class CommandRequest(Message):
    """A command without arguments; which one is in the service's name."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Command_Request"
    request_id: str = ""


class CommandResponse(Message):
    """Whether the command was carried out, and why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Command_Response"
    success: bool = False
    message: str = ""


class SetSpeedRequest(Message):
    """Sim time per wall time: N is N× real time, 0 holds the clock, negative runs as fast as it goes."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/SetSpeed_Request"
    request_id: str = ""
    factor: float = 1.0


class SetSpeedResponse(Message):
    """Whether the speed factor was taken."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/SetSpeed_Response"
    success: bool = False
    message: str = ""


class InjectFaultRequest(Message):
    """Let something go wrong: one fault as JSON, its ``start_s`` counted from now."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/InjectFault_Request"
    request_id: str = ""
    fault_json: str = ""


class InjectFaultResponse(Message):
    """Whether the fault was taken, and why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/InjectFault_Response"
    success: bool = False
    message: str = ""


class FollowerStepRequest(Message):
    """What an external follower is asked in every tick in which the robot is to move; sim time waits for the answer.

    Errors are the robot's against its path (left positive), ``ahead_…`` the means over each of the next ticks of 10 ms.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/FollowerStep_Request"
    step: UInt64 = 0
    first: bool = False
    lateral_m: float = 0.0
    heading_error_rad: float = 0.0
    nozzle_lateral_m: float = 0.0
    speed_mps: float = 0.0
    yaw_rate_radps: float = 0.0
    reference_speed_mps: float = 0.0
    ahead_speed_mps: Float64Array = zeros(0)
    ahead_yaw_rate_radps: Float64Array = zeros(0)


class FollowerStepResponse(Message):
    """The wanted twist of the body until the next tick, and the ``step`` that it answers."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/FollowerStep_Response"
    step: UInt64 = 0
    speed_mps: float = 0.0
    yaw_rate_radps: float = 0.0


class RecordRequest(Message):
    """Start recording to ``path`` (on the bridge's machine)."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Record_Request"
    request_id: str = ""
    path: str = ""


class RecordResponse(Message):
    """Whether recording has begun; everything published after this answer is recorded."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Record_Response"
    success: bool = False
    message: str = ""


class RecordStopRequest(Message):
    """Finish the recording."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/RecordStop_Request"
    request_id: str = ""


class RecordStopResponse(Message):
    """What the finished recording holds; ``lost`` counts messages that never reached the recorder."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/RecordStop_Response"
    success: bool = False
    message: str = ""
    path: str = ""
    messages: UInt64 = 0
    bytes: UInt64 = 0
    lost: UInt64 = 0


class GetPaintRequest(Message):
    """Ask for everything painted so far."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/GetPaint_Request"
    request_id: str = ""


class GetPaintResponse(Message):
    """Every stroke of the session, whole."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/GetPaint_Response"
    strokes: tuple[PaintMarks, ...] = ()


class GetDiagnosticsRequest(Message):
    """Ask a service how it is."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/GetDiagnostics_Request"
    request_id: str = ""


class GetDiagnosticsResponse(Message):
    """How the service is."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/GetDiagnostics_Response"
    diagnostics: DiagnosticArray = DiagnosticArray()
