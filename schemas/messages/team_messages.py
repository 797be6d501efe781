"""Messages between a robot of a team and its coordinator: docs/explanation/teams.md has the rules."""

from typing import ClassVar, Final

from touchline.schemas.messages.base import Float64Array, Message, UInt32, zeros
from touchline.schemas.messages.standard import Header

FIRST_CELL: Final = 0
"""The number of the cell that every robot has where it stands at the start."""

NOTHING_HEARD_S: Final = -1e9
"""An echo of no message: it lets nobody drive."""


class Guidance(Message):
    """Cell that a robot may be in and target that it drives to, or plan that it follows, until a newer message.

    The cell is the intersection of ``half_planes`` n·q ≤ offset, three numbers each: outward unit normal (x, y) and
    offset in m, map frame. ``number`` counts the cells; ``echo_s`` is the newest stamp of the robot's whereabouts that
    counts, by its own clock; the target, in the cell, is where to go.

    A plan is samples of x, y (m), heading (rad), speed (m/s), yaw rate (rad/s), 0.05 s apart, from ``plan_start_s`` by
    the robot's clock on, to rest. It continues the plan ``plan_base``, from which it may differ from ``plan_branch_s``
    on: a robot that follows another plan, or gets it later, refuses it.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/Guidance"
    header: Header = Header()
    number: UInt32 = 0
    echo_s: float = 0.0
    target_x_m: float = 0.0
    target_y_m: float = 0.0
    half_planes: Float64Array = zeros(0)
    plan: Float64Array = zeros(0)
    plan_start_s: float = 0.0
    plan_branch_s: float = 0.0
    plan_base: UInt32 = 0


class PlanState(Message):
    """State of a robot that is guided by plans, and the plan that it follows.

    ``stamp_s`` and ``aligned`` are as in Whereabouts; ``adopted`` is the number of the plan that it follows, 0 where it
    stood at the start, ``decided`` the highest number that it has adopted or refused. ``stays``: without fixes it
    may not drive another such plan, so it refuses newer ones.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/PlanState"
    header: Header = Header()
    stamp_s: float = 0.0
    aligned: bool = True
    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0
    speed_mps: float = 0.0
    yaw_rate_radps: float = 0.0
    adopted: UInt32 = 0
    decided: UInt32 = 0
    stays: bool = False


class Whereabouts(Message):
    """Place of a guided robot, place where it would stand if it braked now, and cell that it keeps to.

    ``stamp_s`` is of its own clock, and later in every message. Until it is ``aligned`` it does not know where it is,
    and the places say nothing. ``adopted`` is the number of the cell that it keeps to,
    0 where it stood at the start; ``decided`` the highest number that it has adopted or refused.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/Whereabouts"
    header: Header = Header()
    stamp_s: float = 0.0
    aligned: bool = True
    x_m: float = 0.0
    y_m: float = 0.0
    stop_x_m: float = 0.0
    stop_y_m: float = 0.0
    adopted: UInt32 = 0
    decided: UInt32 = 0


class TrueWay(Message):
    """True places of an emulated robot in each tick since the last message, map frame; the header is of the last tick.

    It tells so at every exchange with its team in lockstep.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TrueWay"
    header: Header = Header()
    x_m: Float64Array = zeros(0)
    y_m: Float64Array = zeros(0)


class TeamCell(Message):
    """One robot of a team: the corners of its newest cell, where the task wants it, where it is told to go.

    ``resting``: it has been silent for so long that it counts as an obstacle. ``stuck``: it stands before others and is
    sent round them. ``outside_m``: how far it believes itself outside of its cell, negative inside.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TeamCell"
    name: str = ""
    number: UInt32 = 0
    x_m: Float64Array = zeros(0)
    y_m: Float64Array = zeros(0)
    goal_x_m: float = 0.0
    goal_y_m: float = 0.0
    target_x_m: float = 0.0
    target_y_m: float = 0.0
    outside_m: float = 0.0
    resting: bool = False
    stuck: bool = False


class TeamCells(Message):
    """The cells of a team after an update."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/TeamCells"
    header: Header = Header()
    cells: tuple[TeamCell, ...] = ()


class TeamStatus(Message):
    """Status of a team, as its coordinator believes.

    ``arrived`` are within reach of their last goals. ``cost_of_squares`` is how well it is spread, H/H_□: 1 if every
    robot were amid a square of its own. ``nearest_m`` is the least distance of two stopping segments. ``coordinator``:
    which coordinator guides the team and since which epoch, once one has taken over from another.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TeamStatus"
    header: Header = Header()
    task: str = ""
    robots: UInt32 = 0
    arrived: UInt32 = 0
    stuck: UInt32 = 0
    resting: UInt32 = 0
    updates: UInt32 = 0
    cost_of_squares: float = 0.0
    nearest_m: float = 0.0
    outside_m: float = 0.0
    problem: str = ""
    coordinator: str = ""


class TeamReport(Message):
    """Result of a team's task that has ended, as its coordinator believes.

    ``finished``: its time is up or all have arrived; else another task took its place. ``missing`` are those that have
    goals and are not there, each with the reason: "tb3: it is not heard". ``nearest_m`` is the least distance of two
    stopping segments at any of its ``updates``; ``heard`` and ``told`` count messages. ``wishes_json``: how much cells
    have changed what robots wished, and what the team's algorithm has answered.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/TeamReport"
    header: Header = Header()
    task: str = ""
    finished: bool = False
    robots: tuple[str, ...] = ()
    arrived: UInt32 = 0
    missing: tuple[str, ...] = ()
    time_s: float = 0.0
    nearest_m: float = 0.0
    updates: UInt32 = 0
    heard: UInt32 = 0
    told: UInt32 = 0
    wishes_json: str = ""


class BeginGuidedRequest(Message):
    """Drive where a coordinator guides the robot from now on.

    ``coordinator``: the id of its session on the bus; the robot takes guidance of that session alone.
    ``lockstep_s``: an emulated robot holds sim time at every multiple of it until it is answered; 0: it never does.
    ``plans``: guidance has plans instead of cells, and the robot reports its PlanState instead of its Whereabouts.
    ``margin_m``: distance by which the robot may be off its cell or plan; 0: any. Without fixes it stands in time.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/BeginGuided_Request"
    request_id: str = ""
    coordinator: str = ""
    lockstep_s: float = 0.0
    plans: bool = False
    margin_m: float = 0.0


class BeginGuidedResponse(Message):
    """Success if the robot is guided now, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/BeginGuided_Response"
    success: bool = False
    message: str = ""


class SetOwnerRequest(Message):
    """Obey another coordinator from now on: one that takes over from a coordinator which is lost.

    ``coordinator``: the id of its session on the bus; ``epoch``: higher than that of all before. With epoch 0 it only
    asks who guides the robot.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/SetOwner_Request"
    request_id: str = ""
    coordinator: str = ""
    epoch: UInt32 = 0


class SetOwnerResponse(Message):
    """Answer of a robot: success if it obeys that coordinator now, and the plan that it follows; or why not.

    By answering it refuses everything of former coordinators. ``coordinator`` and ``epoch`` say who guides it;
    ``state`` and ``plan``, from ``plan_start_s`` on as in Guidance, what it does, by its own clock.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/SetOwner_Response"
    success: bool = False
    message: str = ""
    coordinator: str = ""
    epoch: UInt32 = 0
    state: PlanState = PlanState()
    plan: Float64Array = zeros(0)
    plan_start_s: float = 0.0


class TeamTaskRequest(Message):
    """A team's task from now on, as JSON of ``touchline.schemas.team.TaskSpec``."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/TeamTask_Request"
    request_id: str = ""
    task_json: str = ""


class TeamTaskResponse(Message):
    """Success if the team goes on with that task, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/TeamTask_Response"
    success: bool = False
    message: str = ""


class TeamRobotRequest(Message):
    """Take a robot out of a team, or admit one again that was taken out.

    Who is taken out may be no obstacle any more: unless ``force``, it is refused while the robot may drive.
    """

    ros_type: ClassVar[str] = "touchline_msgs/srv/TeamRobot_Request"
    request_id: str = ""
    robot: str = ""
    force: bool = False


class TeamRobotResponse(Message):
    """Success and what has to be seen to now, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/TeamRobot_Response"
    success: bool = False
    message: str = ""
