"""The one table of topics and services. Nothing else in Touchline spells a key.

Keys on the wire are ``<namespace>/<name>``, the mapping of zenoh-plugin-ros2dds.
"""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from touchline.schemas import messages as m
from touchline.schemas.messages.base import Message
from touchline.schemas.roles import Role

Request = TypeVar("Request", bound=Message)
Response = TypeVar("Response", bound=Message)

#: Robot namespace used when none is given.
DEFAULT_NAMESPACE = "tt2"
#: Namespace of a team's coordinator where none is given: it is no robot, but is told of like one.
TEAM_NAMESPACE = "team"
NAMESPACE_RULE = "use letters, digits, _ and single /, at most 64 in all"


#: Those who are told how anything is.
ANYBODY = frozenset(Role) - {Role.ROUTER}
#: Those who decide what robots do.
_ORDERING = frozenset((Role.OPERATOR, Role.GATEWAY))
#: Those who may stop robots, too.
_STOPPING = _ORDERING | {Role.VIEWER, Role.COORDINATOR}
_ROBOT, _TEAM = frozenset((Role.ROBOT,)), frozenset((Role.COORDINATOR,))
_SERVING = frozenset((Role.ROBOT, Role.PLANNER, Role.BRIDGE, Role.COORDINATOR, Role.SUPERVISOR))


def is_namespace(text: str) -> bool:
    """Return whether a robot may be called so."""
    return len(text) <= 64 and all(part.replace("_", "").isalnum() for part in text.split("/"))


@dataclass(frozen=True)
class Topic:
    """One row of the topic table.

    Attributes:
        name: ROS name without its leading slash, under the robot's namespace.
        type: Message type.
        rate_hz: Nominal rate in sim time; 0 when it is sent on an event.
        recorded: Whether the recorder takes it and runs must reproduce it bit for bit.
        latched: Whether late joiners get the last message (ROS: transient local).
        block: Whether a full queue blocks the publisher (nothing is lost) or drops.
        prompt: Whether changes also come as copies that overtake telemetry (`touchline.bus.prompt`).
        units: Units of its main values.
        tolerance: Largest difference that a regression check accepts, per number, in those units.
        hashed: Whether it counts in a session's hash; what has caused a session does not.
        general: Whether it belongs to every session; any other counts in a session's hash only where it is sent.
        publishers: Roles that may publish it on a secured bus; a robot only its own.
    """

    name: str
    type: type[Message]
    rate_hz: float = 0.0
    recorded: bool = True
    latched: bool = False
    block: bool = True
    prompt: bool = False
    units: str = ""
    tolerance: float = 0.0
    general: bool = True
    hashed: bool = True
    publishers: frozenset[Role] = _ROBOT

    @property
    def reliable(self) -> bool:
        """True if the transport retransmits: always for topics that block."""
        return self.block


@dataclass(frozen=True)
class Service(Generic[Request, Response]):
    """One row of the service table; every service is a Zenoh queryable that answers once.

    Attributes:
        name: ROS name without its leading slash, under the robot's namespace.
        request, response: Message types.
        server: Node that answers it, and no other is believed; empty where anybody may.
        most_bytes: A larger request is refused unread.
        urgent: Whether it goes before everything else on its way, and is looked for first: what stops the robot.
        callers: Roles that may ask for it on a secured bus.
        ros_type: ROS service type.
    """

    name: str
    request: type[Request]
    response: type[Response]
    server: str
    most_bytes: int = 16 * 1024
    urgent: bool = False
    callers: frozenset[Role] = _ORDERING
    ros_type: str = field(init=False)

    def __post_init__(self) -> None:
        """Derive the ROS service type from the request's."""
        object.__setattr__(self, "ros_type", self.request.ros_type.removesuffix("_Request"))

    @property
    def servers(self) -> frozenset[Role]:
        """Roles that may serve it on a secured bus."""
        return frozenset((ROLE_OF_NODE[self.server],)) if self.server else _ORDERING


def _rows_since(known: Collection[Topic]) -> tuple[Topic, ...]:
    """The rows of this module so far, in their order, but for those that are known."""
    return tuple(row for row in globals().values() if isinstance(row, Topic) and row not in known)


CLOCK = Topic("clock", m.Clock, 10, units="s")
GNSS_FIX = Topic("gnss/fix", m.NavSatFix, 10, units="deg, m", tolerance=1e-9)
GNSS_STATUS = Topic("gnss/status", m.GnssStatus, 10, latched=True, units="m, s", tolerance=1e-9)
#: Of a robot that a camera overhead positions; it has no GNSS.
CAMERA_POSE = Topic("camera/pose", m.PoseWithCovarianceStamped, 15, units="m, rad", tolerance=1e-9, general=False)
#: Of auxiliary sensors, if the vehicle has any.
SENSOR_SAMPLE = Topic("sensors/samples", m.SensorSample, tolerance=1e-9, general=False)
#: Of lidars and ultrasonic rangers; the frame is the sensor's name.
SCAN = Topic("scan", m.LaserScan, units="m, rad", tolerance=1e-6, general=False)
RANGE = Topic("range", m.Range, units="m, rad", tolerance=1e-6, general=False)
IMU = Topic("imu/data_raw", m.Imu, 100, units="rad/s, m/s2", tolerance=1e-9)
MAGNETIC_FIELD = Topic("imu/mag", m.MagneticField, 100, units="T", tolerance=1e-12)
JOINT_STATES = Topic("joint_states", m.JointState, 100, units="rad, rad/s", tolerance=1e-9)
ACTUATOR_COMMAND = Topic("cmd/actuators", m.ActuatorCommand, 100, units="rad/s, rad", tolerance=1e-6)
ODOMETRY = Topic("odometry/filtered", m.Odometry, 50, latched=True, units="m, rad", tolerance=1e-6)
ESTIMATOR = Topic("estimator/status", m.EstimatorStatus, 10, units="m, rad", tolerance=1e-6)
TRUTH = Topic("truth/odometry", m.Odometry, 50, units="m, rad", tolerance=1e-6)
#: Of a log that was imported: where another instrument says that the robot was.
REFERENCE = Topic("reference/odometry", m.Odometry, units="m, rad", tolerance=1e-6, general=False)
SPRAYER = Topic("sprayer/state", m.SprayerState, 1, latched=True, units="l, l/s", tolerance=1e-9)
TRUE_COVERAGE = Topic("truth/coverage", m.TrueCoverage, 10, latched=True, units="m", tolerance=1e-6)
PAINT = Topic("truth/paint", m.PaintMarks, 10, units="m", tolerance=1e-6)
#: These two of a vehicle whose tool covers areas, on a template that has some.
AREA = Topic("truth/area", m.AreaProgress, 1, latched=True, units="m2, %", tolerance=1e-6, general=False)
AREA_REPORT = Topic("truth/area_report", m.AreaReport, latched=True, units="m2, %, m", tolerance=1e-6, general=False)
#: Of a traversal in which the robot has touched anything.
CONTACT_REPORT = Topic(
    "truth/contact_report", m.ContactReport, latched=True, units="m, m/s, J", tolerance=1e-6, general=False
)
STATUS = Topic("traversal/status", m.TraversalStatus, 10, latched=True, prompt=True, units="m, s", tolerance=1e-6)
#: Of a robot that pauses.
PAUSE_STATUS = Topic("traversal/pause_status", m.PauseStatus, latched=True, prompt=True, units="s", general=False)
#: It follows from orders and status, so it counts in no hash.
ABOUT_TO_MOVE = Topic("about_to_move", m.AboutToMove, latched=True, units="s", general=False, hashed=False)
REPORT = Topic("traversal/report", m.TraversalReport, latched=True, units="m, s, m2", tolerance=1e-6)
BATTERY = Topic("battery_state", m.BatteryState, 1, latched=True, units="V, A, Ah", tolerance=1e-6)
EVENTS = Topic("events", m.Event, publishers=_ROBOT | _TEAM | {Role.BRIDGE})
#: What the robot was told to do, and when it obeyed.
ORDERS = Topic("traversal/orders", m.RobotOrder, general=False, hashed=False)
#: JSON of the state in which a robot that has not just been switched on was given a job, before all that is told of it.
INITIAL_STATE = Topic("traversal/initial_state", m.String, general=False, hashed=False)
#: Of a robot of a shared job, from who leads that: the stretch of its path that the others keep off.
CLAIMED = Topic(
    "traversal/claimed",
    m.NavPath,
    latched=True,
    units="m",
    tolerance=1e-6,
    general=False,
    hashed=False,
    publishers=frozenset((Role.OPERATOR,)),
)
#: What the robot can go on with after an abort or a restart.
UNFINISHED = Topic(
    "traversal/unfinished", m.UnfinishedJob, recorded=False, latched=True, units="%, m, s", general=False
)
#: Of a robot that a team's coordinator guides.
WHEREABOUTS = Topic("traversal/whereabouts", m.Whereabouts, 10, units="m, s", tolerance=1e-6, general=False)
#: Instead, of one that it guides by plans.
PLAN_STATE = Topic("traversal/plan_state", m.PlanState, 10, units="m, rad, s", tolerance=1e-6, general=False)
#: Of an emulated robot in lockstep with its team: by this, who touches whom has its bumper pressed.
TRUE_WAY = Topic("truth/way", m.TrueWay, recorded=False, units="m", general=False)
#: Of a robot with a lidar: what it sees near it.
OBSTACLES = Topic("obstacles", m.Obstacles, 5, units="m, m/s", tolerance=1e-6, general=False)
#: Of a robot with a lidar: what it does about things in its way.
WAY_ROUND = Topic("traversal/way_round", m.WayRound, latched=True, units="m, m2", tolerance=1e-6, general=False)
#: Of a robot with a lidar under way: where a thing that may move stops it, and where one slows it down. They follow
#: from its state, so they count in no hash.
STOP_ZONE = Topic("protection/stop_zone", m.PolygonStamped, 5, units="m", tolerance=1e-5, general=False, hashed=False)
SLOW_ZONE = Topic("protection/slow_zone", m.PolygonStamped, 5, units="m", tolerance=1e-5, general=False, hashed=False)
#: From the coordinator to a robot.
GUIDANCE = Topic("traversal/guidance", m.Guidance, units="m, s", tolerance=1e-6, general=False, publishers=_TEAM)
#: Of a team whose algorithm is in processes of others: JSON of what its robot may know, and of what it wishes.
ALGORITHM_STATE = Topic("algorithm/state", m.String, general=False, hashed=False, publishers=_TEAM)
ALGORITHM_WISH = Topic("algorithm/wish", m.String, general=False, hashed=False, publishers=frozenset((Role.OPERATOR,)))
PLAN = Topic("plan", m.Trajectory, latched=True, units="m", tolerance=1e-9)
TEMPLATE = Topic("template", m.String, latched=True)
#: JSON of ``touchline.schemas.setup.Setup``.
SETUP = Topic("setup", m.String, latched=True)
#: These of a team's coordinator, under a namespace of its own; the first is JSON of ``touchline.schemas.team``.
TEAM_SETUP = Topic("fleet/setup", m.String, latched=True, general=False, publishers=_TEAM)
TEAM_CELLS = Topic("fleet/cells", m.TeamCells, latched=True, units="m", tolerance=1e-6, general=False, publishers=_TEAM)
TEAM_STATUS = Topic(
    "fleet/status", m.TeamStatus, latched=True, units="m", tolerance=1e-6, general=False, publishers=_TEAM
)
#: Of a task that has ended.
#: Tasks and robots of a team's dispatcher, as JSON.
TEAM_QUEUE = Topic("fleet/queue", m.String, latched=True, general=False, publishers=_TEAM)
TEAM_REPORT = Topic(
    "fleet/report", m.TeamReport, latched=True, units="m, s", tolerance=1e-6, general=False, publishers=_TEAM
)
#: What another coordinator needs to go on with the team's task, as JSON.
TEAM_MEMORY = Topic("fleet/memory", m.String, recorded=False, latched=True, general=False, publishers=_TEAM)
#: Of a replay, which sends what its robots said as if they were there.
REPLAY_STATUS = Topic("replay/status", m.ReplayStatus, 10, recorded=False, latched=True, units="s", general=False)
PLANNER_PROGRESS = Topic("planner/progress", m.Progress, recorded=False, publishers=frozenset((Role.PLANNER,)))
DIAGNOSTICS = Topic("diagnostics", m.DiagnosticArray, 5, recorded=False, publishers=_SERVING)
SUPERVISOR_EVENTS = Topic("supervisor/events", m.Event, recorded=False, publishers=_SERVING | {Role.OPERATOR})
#: From the bridge while its recording is behind: how far sim time may go that passes faster than real time.
RECORDER_LIMIT = Topic(
    "recording/limit",
    m.Clock,
    recorded=False,
    block=False,
    units="s",
    general=False,
    publishers=frozenset((Role.BRIDGE,)),
)

TOPICS: tuple[Topic, ...] = _rows_since(())
TOPIC_BY_NAME = {topic.name: topic for topic in TOPICS}

#: What viewers (Foxglove, Lichtblick, RViz) draw. The bridge makes it of the topics above, for who looks at them live
#: and in recordings; it is not on the bus, counts in no hash, and is neither replayed nor checked.
TRANSFORMS = Topic("tf", m.TFMessage, 10, units="m")
STATIC_TRANSFORMS = Topic("tf_static", m.TFMessage, latched=True, units="m")
PLAN_PATH = Topic("plan/path", m.NavPath, latched=True, units="m")
TEMPLATE_MARKERS = Topic("template/markers", m.MarkerArray, latched=True, units="m")
BODY_MARKERS = Topic("body/markers", m.MarkerArray, latched=True, units="m")
TRUE_TRANSFORMS = Topic("truth/tf", m.TFMessage, 10, units="m")
TRUE_BODY_MARKERS = Topic("truth/body/markers", m.MarkerArray, latched=True, units="m")
#: Of the paint, or what a covering tool has been over: all but the latest stretch, and that stretch.
WORK_MARKERS = Topic("truth/ground/markers", m.MarkerArray, latched=True, units="m")
LATEST_WORK_MARKERS = Topic("truth/ground/latest_markers", m.MarkerArray, 1, latched=True, units="m")
#: Of a robot with a lidar.
OBSTACLE_MARKERS = Topic("obstacles/markers", m.MarkerArray, 5, units="m")
VIEWING: tuple[Topic, ...] = _rows_since(TOPICS)
VIEWING_BY_NAME = {topic.name: topic for topic in VIEWING}
#: Topics by names that they have in older recordings.
FORMER_NAMES = {"paint/marks": PAINT, "cmd/wheels": ACTUATOR_COMMAND}
RECORDED = tuple(topic for topic in TOPICS if topic.recorded)

#: Names of the processes, as their liveliness tokens and diagnostics carry them.
PLANNER, ROBOT_SIM, BRIDGE, CONSOLE, OPERATOR, OBSERVER, SUPERVISOR, TELEMETRY, REPLAY, COORDINATOR, STANDBY = (
    "planner",
    "robot-sim",
    "bridge",
    "tui",
    "operator",
    "observer",
    "supervisor",
    "telemetry",
    "replay",
    "coordinator",
    "standby",
)
#: The role whose identity a process of a name needs on a secured bus. A replay publishes what its robot did.
ROLE_OF_NODE = {
    PLANNER: Role.PLANNER,
    ROBOT_SIM: Role.ROBOT,
    TELEMETRY: Role.ROBOT,
    REPLAY: Role.ROBOT,
    BRIDGE: Role.BRIDGE,
    CONSOLE: Role.OPERATOR,
    OPERATOR: Role.OPERATOR,
    OBSERVER: Role.OBSERVER,
    SUPERVISOR: Role.SUPERVISOR,
    COORDINATOR: Role.COORDINATOR,
    STANDBY: Role.COORDINATOR,
}
#: Of these, some are there wherever there is a robot, or was until it died.
SERVING = (PLANNER, ROBOT_SIM, BRIDGE)
#: For these a replay answers: the robot that it replays is not there.
REPLAYED = (ROBOT_SIM, TELEMETRY)
#: Largest plan, or template to plan, that is taken: 80,000 segments.
MOST_PLAN_BYTES = 16 * 1024 * 1024


PLAN_SERVICE = Service(
    "planner/plan", m.PlanRequest, m.PlanResponse, PLANNER, MOST_PLAN_BYTES, callers=_ORDERING | _ROBOT
)
START_TRAVERSAL = Service(
    "trajectory_controller/start_traversal",
    m.StartTraversalRequest,
    m.StartTraversalResponse,
    ROBOT_SIM,
    MOST_PLAN_BYTES,
)
LOAD = Service("traversal/load", m.LoadRequest, m.LoadResponse, ROBOT_SIM, MOST_PLAN_BYTES)
GOTO = Service("traversal/goto", m.GotoRequest, m.GotoResponse, ROBOT_SIM, MOST_PLAN_BYTES)
BEGIN_GUIDED = Service(
    "traversal/begin_guided", m.BeginGuidedRequest, m.BeginGuidedResponse, ROBOT_SIM, callers=_ORDERING | _TEAM
)
START = Service("traversal/start", m.CommandRequest, m.CommandResponse, ROBOT_SIM, callers=_ORDERING | _TEAM)
PAUSE = Service("traversal/pause", m.CommandRequest, m.CommandResponse, ROBOT_SIM, urgent=True, callers=_STOPPING)
RESUME = Service("traversal/resume", m.CommandRequest, m.CommandResponse, ROBOT_SIM, callers=_ORDERING | _TEAM)
ABORT = Service("traversal/abort", m.CommandRequest, m.CommandResponse, ROBOT_SIM, urgent=True, callers=_STOPPING)
ESTOP = Service("traversal/estop", m.CommandRequest, m.CommandResponse, ROBOT_SIM, urgent=True, callers=_STOPPING)
#: Answers to a robot that waits before something: it is to wait on, to go round now, or to do so and not come back.
WAIT_ON = Service("traversal/wait_on", m.CommandRequest, m.CommandResponse, ROBOT_SIM)
GO_ROUND = Service("traversal/go_round", m.CommandRequest, m.CommandResponse, ROBOT_SIM)
LEAVE_OUT = Service("traversal/leave_out", m.CommandRequest, m.CommandResponse, ROBOT_SIM)
RESET = Service("traversal/reset", m.CommandRequest, m.CommandResponse, ROBOT_SIM)
REFILL_TANK = Service("sprayer/refill", m.CommandRequest, m.CommandResponse, ROBOT_SIM)
REPLACE_BATTERY = Service("battery/replace", m.CommandRequest, m.CommandResponse, ROBOT_SIM)
AUTHORIZE = Service("traversal/authorize", m.AuthorizeRequest, m.AuthorizeResponse, ROBOT_SIM)
SET_SPEED = Service("simulation/set_speed", m.SetSpeedRequest, m.SetSpeedResponse, ROBOT_SIM, callers=_ORDERING | _TEAM)
INJECT_FAULT = Service(
    "simulation/inject_fault", m.InjectFaultRequest, m.InjectFaultResponse, ROBOT_SIM, callers=_ORDERING | _TEAM
)
#: Served from outside, by a user's own follower, and asked by the robot; not one of ``SERVICES``.
FOLLOWER_STEP = Service("follower/step", m.FollowerStepRequest, m.FollowerStepResponse, "", callers=_ROBOT)
#: Served by the gateway among ROS 2 nodes, for the node that the robot is there; not on the bus.
PARAMETER_SERVICES: tuple[Service[Any, Any], ...] = (
    Service("touchline/list_parameters", m.ListParametersRequest, m.ListParametersResponse, ""),
    Service("touchline/get_parameters", m.GetParametersRequest, m.GetParametersResponse, ""),
    Service("touchline/get_parameter_types", m.GetParameterTypesRequest, m.GetParameterTypesResponse, ""),
    Service("touchline/describe_parameters", m.DescribeParametersRequest, m.DescribeParametersResponse, ""),
    Service("touchline/set_parameters", m.SetParametersRequest, m.SetParametersResponse, ""),
    Service(
        "touchline/set_parameters_atomically",
        m.SetParametersAtomicallyRequest,
        m.SetParametersAtomicallyResponse,
        "",
    ),
)
#: Served by a team's coordinator; not among ``SERVICES``, as those are of every system.
TEAM_TASK = Service("fleet/task", m.TeamTaskRequest, m.TeamTaskResponse, COORDINATOR, 1024 * 1024)
#: To a dispatcher, as JSON: requests to add, a task to cancel, or neither, for its queue.
TEAM_REQUESTS = Service("fleet/requests", m.TeamTaskRequest, m.TeamTaskResponse, COORDINATOR, 1024 * 1024)
TEAM_STOP = Service("fleet/stop", m.CommandRequest, m.CommandResponse, COORDINATOR, urgent=True, callers=_STOPPING)
TEAM_REMOVE = Service("fleet/remove", m.TeamRobotRequest, m.TeamRobotResponse, COORDINATOR)
TEAM_ADMIT = Service("fleet/admit", m.TeamRobotRequest, m.TeamRobotResponse, COORDINATOR)
#: From a coordinator that takes over from another one, to a robot that is guided; as little
#: among ``SERVICES``.
SET_OWNER = Service("traversal/set_owner", m.SetOwnerRequest, m.SetOwnerResponse, ROBOT_SIM, callers=_TEAM)
#: Served by who shares a template among robots, for each of them; as little among ``SERVICES``.
TAKE_OVER = Service("sharing/take_over", m.CommandRequest, m.CommandResponse, OPERATOR)
REMOVE = Service("sharing/remove", m.CommandRequest, m.CommandResponse, OPERATOR)
#: Served by a replay for each of its robots; whichever of them is told, all go by it. As little among ``SERVICES``.
REPLAY_PAUSE = Service("replay/pause", m.CommandRequest, m.CommandResponse, REPLAY, callers=_ORDERING | {Role.VIEWER})
REPLAY_RESUME = Service("replay/resume", m.CommandRequest, m.CommandResponse, REPLAY, callers=_ORDERING | {Role.VIEWER})
REPLAY_SEEK = Service(
    "replay/seek", m.ReplaySeekRequest, m.ReplaySeekResponse, REPLAY, callers=_ORDERING | {Role.VIEWER}
)
REPLAY_STEP = Service(
    "replay/step", m.ReplayStepRequest, m.ReplayStepResponse, REPLAY, callers=_ORDERING | {Role.VIEWER}
)
REPLAY_SET_SPEED = Service(
    "replay/set_speed", m.SetSpeedRequest, m.SetSpeedResponse, REPLAY, callers=_ORDERING | {Role.VIEWER}
)
REPLAY_SET_LOOPS = Service(
    "replay/set_loops", m.ReplaySetLoopsRequest, m.ReplaySetLoopsResponse, REPLAY, callers=_ORDERING | {Role.VIEWER}
)
REPLAY_SERVICES: tuple[Service[Any, Any], ...] = (
    REPLAY_PAUSE,
    REPLAY_RESUME,
    REPLAY_SEEK,
    REPLAY_STEP,
    REPLAY_SET_SPEED,
    REPLAY_SET_LOOPS,
)
GET_PAINT = Service("truth/get_paint", m.GetPaintRequest, m.GetPaintResponse, TELEMETRY, callers=ANYBODY)
RECORD = Service("bridge/record", m.RecordRequest, m.RecordResponse, BRIDGE)
RECORD_STOP = Service("bridge/record_stop", m.RecordStopRequest, m.RecordStopResponse, BRIDGE)


#: What a robot can be told to do. A replay refuses these.
ROBOT_SERVICES: tuple[Service[Any, Any], ...] = (
    START_TRAVERSAL,
    LOAD,
    GOTO,
    BEGIN_GUIDED,
    START,
    PAUSE,
    RESUME,
    ABORT,
    ESTOP,
    RESET,
    REFILL_TANK,
    REPLACE_BATTERY,
    WAIT_ON,
    GO_ROUND,
    LEAVE_OUT,
    AUTHORIZE,
    SET_SPEED,
    INJECT_FAULT,
)


def diagnostics_service(node: str) -> Service[m.GetDiagnosticsRequest, m.GetDiagnosticsResponse]:
    """The service by which any process tells how it is."""
    name = f"{node}/diagnostics"
    return Service(name, m.GetDiagnosticsRequest, m.GetDiagnosticsResponse, node, callers=ANYBODY)


#: What changes nothing, whoever asks.
READ_ONLY_SERVICES: tuple[Service[Any, Any], ...] = (
    GET_PAINT,
    *(diagnostics_service(node) for node in (PLANNER, ROBOT_SIM, TELEMETRY, BRIDGE)),
)
#: What Touchline itself serves.
SERVICES: tuple[Service[Any, Any], ...] = (
    PLAN_SERVICE,
    *ROBOT_SERVICES,
    RECORD,
    RECORD_STOP,
    *READ_ONLY_SERVICES,
)
#: Every service on the bus: those, and the ones of teams, shared jobs, replays and users' own followers.
ALL_SERVICES: tuple[Service[Any, Any], ...] = (
    *(row for row in globals().copy().values() if isinstance(row, Service)),
    *(diagnostics_service(node) for node in ROLE_OF_NODE),
)
