"""Requests and answers of all services but planning."""

from typing import ClassVar

from touchline.schemas.messages.base import Float64Array, Message, UInt64, zeros
from touchline.schemas.messages.plan_messages import PlanOptions, PoseGoal
from touchline.schemas.messages.standard import DiagnosticArray
from touchline.schemas.messages.touchline import PaintMarks
from touchline.schemas.messages.turf_tank import Trajectory


class LoadRequest(Message):
    """Load a trajectory; with the template (JSON text, may be empty) paint is evaluated against it.

    ``resume``: go on where the robot was in this very trajectory when it was aborted or its process died; without
    segments, in the one that its journal keeps. ``here``: the robot stands where it begins, and is not carried there.
    ``replace``: the robot is driving, and goes on along this one without a stop. At most one of the three.
    ``cause_json``: what the plan was made from (``touchline.schemas.plan_cause``), for the recording; may be empty.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Load_Request"
    request_id: str = ""
    trajectory: Trajectory = Trajectory()
    template_json: str = ""
    resume: bool = False
    here: bool = False
    replace: bool = False
    cause_json: str = ""


class LoadResponse(Message):
    """Success if the trajectory was taken; ``total_time`` in seconds."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Load_Response"
    success: bool = False
    message: str = ""
    total_time: float = 0.0


class GotoRequest(Message):
    """Drive to a pose from where the robot is, at rest or amid a drive to another one: plan, load and start in one.

    The options are those of a plan; their ``start`` is left empty. ``ground_json`` is as in a plan's request.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Goto_Request"
    request_id: str = ""
    goal: PoseGoal = PoseGoal()
    options: PlanOptions = PlanOptions()
    ground_json: str = ""


class GotoResponse(Message):
    """Success and what was planned once the robot is on its way, or the reason why not; ``total_time`` in seconds."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Goto_Response"
    success: bool = False
    message: str = ""
    total_time: float = 0.0


class CommandRequest(Message):
    """A command without arguments; which one is in the service's name."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Command_Request"
    request_id: str = ""


class CommandResponse(Message):
    """Success if the command was carried out, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Command_Response"
    success: bool = False
    message: str = ""


class AuthorizeRequest(Message):
    """Drive along the loaded trajectory no further than ``until_m`` (arc length, m; infinite: to its end) for now.

    The robot comes to rest there, valve closed, and goes on when that is moved on. A load lets it drive to the end.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Authorize_Request"
    request_id: str = ""
    until_m: float = 0.0


class AuthorizeResponse(Message):
    """Success if the authority was taken, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Authorize_Response"
    success: bool = False
    message: str = ""


class SetSpeedRequest(Message):
    """Sim time per wall time: N is N× real time, 0 holds the clock, negative runs as fast as it goes."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/SetSpeed_Request"
    request_id: str = ""
    factor: float = 1.0


class SetSpeedResponse(Message):
    """Success if the speed factor was taken."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/SetSpeed_Response"
    success: bool = False
    message: str = ""


class InjectFaultRequest(Message):
    """Let something go wrong: one fault as JSON, its ``start_s`` counted from now."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/InjectFault_Request"
    request_id: str = ""
    fault_json: str = ""


class InjectFaultResponse(Message):
    """Success if the fault was taken, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/InjectFault_Response"
    success: bool = False
    message: str = ""


class FollowerStepRequest(Message):
    """Request to an external follower in every tick in which the robot moves; sim time waits for the answer.

    Errors are the robot's against its path (left positive), ``ahead_…`` the means over each of the next ticks of 10 ms.
    The last four are of a reference that keeps the plan's time, 0 unless the follower is ``external-timed``: how far it
    is ahead and to the left in the robot's frame, its heading less the robot's, and the derivative of its speed.
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
    along_m: float = 0.0
    across_m: float = 0.0
    turn_rad: float = 0.0
    reference_acceleration_mps2: float = 0.0


class FollowerStepResponse(Message):
    """The wanted twist of the body until the next tick, and the ``step`` that it answers."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/FollowerStep_Response"
    step: UInt64 = 0
    speed_mps: float = 0.0
    yaw_rate_radps: float = 0.0


class RecordRequest(Message):
    """Start recording to ``path`` (on the bridge's machine).

    A file that has ``max_bytes``, or ``max_s`` of sim time, goes on in a next part; 0 for no limit.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/Record_Request"
    request_id: str = ""
    path: str = ""
    max_bytes: UInt64 = 0
    max_s: float = 0.0


class RecordResponse(Message):
    """Success once recording has begun; everything published after this answer is recorded."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/Record_Response"
    success: bool = False
    message: str = ""


class RecordStopRequest(Message):
    """Finish the recording."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/RecordStop_Request"
    request_id: str = ""


class RecordStopResponse(Message):
    """Contents of the finished recording; ``lost`` counts messages that never reached the recorder."""

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
    """Health of the service."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/GetDiagnostics_Response"
    diagnostics: DiagnosticArray = DiagnosticArray()
