"""Status of a replay, and requests to it."""

from typing import ClassVar

from touchline.schemas.messages.base import Message, UInt32


class ReplayStatus(Message):
    """Status of a replay, sent for each robot that it replays, ten times a second and when it changes.

    Times are s on the recording's own clock, that of its robot. ``speed`` is sim time per wall time, negative as fast
    as it goes. It is in pass ``loop``, from 1, of ``loops``, 0 without end. ``jumps`` counts seeks and new passes: with
    each, what was replayed before is void, and what holds at the new time is sent again
    (``touchline.schemas.replay_run``). ``begin_wall_s`` is the wall time at ``begin_s``, s since 1970, 0 if unknown.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/ReplayStatus"
    file: str = ""
    robots: tuple[str, ...] = ()
    begin_s: float = 0.0
    end_s: float = 0.0
    now_s: float = 0.0
    begin_wall_s: float = 0.0
    speed: float = 1.0
    playing: bool = False
    jumps: UInt32 = 0
    loop: UInt32 = 1
    loops: UInt32 = 1


class ReplaySeekRequest(Message):
    """Go to a time of the recording, s on its own clock; times outside of it are those of its ends."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/ReplaySeek_Request"
    request_id: str = ""
    time_s: float = 0.0


class ReplaySeekResponse(Message):
    """Success once the messages in force at that time have been sent, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/ReplaySeek_Response"
    success: bool = False
    message: str = ""


class ReplayStepRequest(Message):
    """Send the next messages, or those of the next ``seconds``, at once, and pause; one of both is given."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/ReplayStep_Request"
    request_id: str = ""
    messages: UInt32 = 0
    seconds: float = 0.0


class ReplayStepResponse(Message):
    """Success once they have been sent, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/ReplayStep_Response"
    success: bool = False
    message: str = ""


class ReplaySetLoopsRequest(Message):
    """Number of passes in all, former ones and the present one included; 0 without end."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/ReplaySetLoops_Request"
    request_id: str = ""
    loops: UInt32 = 0


class ReplaySetLoopsResponse(Message):
    """Success if the number was taken, or the reason why not."""

    ros_type: ClassVar[str] = "touchline_msgs/srv/ReplaySetLoops_Response"
    success: bool = False
    message: str = ""
