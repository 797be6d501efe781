"""Touchline's own messages on topics, for what no standard type covers."""

import json
from typing import Annotated, Any, ClassVar

from pydantic import Field

from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Float64Array, Message, UInt8, UInt32, zeros
from touchline.schemas.messages.standard import Header, Time


class ActuatorCommand(Message):
    """Commands to the drive's actuators: one of ``values`` for each of ``names``, in rad/s or rad as its drive says."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/ActuatorCommand"
    header: Header = Header()
    names: tuple[str, ...] = ()
    values: Float64Array = zeros(0)


class GnssStatus(Message):
    """RTK state of the fix, which NavSatFix has no field for."""

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
    """Consistency of the robot's estimator: innovations, normalised squares (NIS) and what was not used.

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
    """Status of the traversal, as the robot believes; ``TrueCoverage`` has the truth.

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


class PauseStatus(Message):
    """Cause and end of a pause: sent with every ``TraversalStatus`` while the robot pauses, and once afterwards.

    ``cause`` is NONE once it does not pause any more. ``source`` names who or what ordered the pause: the operator, a
    hazard (``tank-low``), a follower. ``ends_by_itself``: the robot moves off without a person, at ``earliest`` (sim
    time) or later; otherwise it waits for ``resume``.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PauseStatus"
    NONE: ClassVar[int] = 0
    OPERATOR: ClassVar[int] = 1
    LINK: ClassVar[int] = 2
    WATCHDOG: ClassVar[int] = 3
    SHUT_DOWN: ClassVar[int] = 4
    LOCALIZATION: ClassVar[int] = 5
    HAZARD: ClassVar[int] = 6
    FOLLOWER: ClassVar[int] = 7
    EMERGENCY_STOP: ClassVar[int] = 8
    IN_THE_WAY: ClassVar[int] = 9
    header: Header = Header()
    cause: Annotated[UInt8, Field(le=9)] = 0
    source: str = ""
    ends_by_itself: bool = False
    earliest: Time = Time()


class SensorSample(Message):
    """A measurement of an auxiliary sensor, stamped with its time; the header's frame is the sensor's name.

    ``kind`` is what it is registered as; the order and units of ``values`` are in the documentation of that kind.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/SensorSample"
    header: Header = Header()
    kind: str = ""
    values: Float64Array = zeros(0)


class AboutToMove(Message):
    """The warning that a robot gives before it moves off: what its horn and beacon are to do.

    Sent when the warning begins (``active``), at least two seconds of robot time before the wheels turn, and when it
    ends. It stays active while the robot works: it may then start, stop and turn at any time. ``earliest`` is the sim
    time before which the robot does not move off, ``reason`` says on whose order it does.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/AboutToMove"
    header: Header = Header()
    active: bool = False
    earliest: Time = Time()
    reason: str = ""


class UnfinishedJob(Message):
    """A job that the robot was on and can go on with, after an abort or after its process ended; by its journal.

    Load with ``resume`` and an empty trajectory to go on. ``total_length_m`` is 0 if there is none. ``name`` is the
    template's, "" of a plan without one; ``done_pct`` the share of its work that the robot believes to have done;
    ``reason`` why the job ended.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/UnfinishedJob"
    header: Header = Header()
    name: str = ""
    done_pct: float = 0.0
    arc_length_m: float = 0.0
    total_length_m: float = 0.0
    elapsed_s: float = 0.0
    reason: str = ""


class TrueCoverage(Message):
    """True paint, which only an emulator can know.

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


class RobotOrder(Message):
    """A command that the robot has obeyed, as it counts for its session: the stamp is of the tick after which it came.

    ``details_json`` is a JSON object with what belongs to the command, as docs/reference/recordings.md tells.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/RobotOrder"
    header: Header = Header()
    name: str = ""
    details_json: str = ""

    def details(self) -> dict[str, Any]:
        """Return what belongs to the command.

        Raises:
            PayloadError: ``details_json`` is not a JSON object.
        """
        try:
            found = json.loads(self.details_json or "{}")
        except (ValueError, RecursionError) as error:
            raise PayloadError(f"{self.ros_type}: details_json: is not JSON ({error})") from error
        if not isinstance(found, dict):
            raise PayloadError(f"{self.ros_type}: details_json: is not a JSON object")
        return found


class Progress(Message):
    """Progress of a long request; ``fraction`` is 0…1."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/Progress"
    request_id: str = ""
    stage: str = ""
    fraction: float = 0.0
