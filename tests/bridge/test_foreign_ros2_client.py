"""Robot and gateway as real processes, and a ROS 2 client that others wrote (zenoh-ros2-sdk) as another.

Proves that the robot fits a ROS 2 framework: the client, given nothing but our message definitions and an address,
finds everything, reads the values that our own bus has, and calls ``/trajectory_controller/start_traversal``.
"""

import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.bridge.ros2_machine import ForeignClient, foreign_client
from tests.robot_sim.scripted import trajectory
from tests.system.commands import figures, touchline
from touchline.bus import Bus, BusConfig, CallError
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.curves import Curve
from touchline.schemas.definition_folder import write_definitions
from touchline.schemas.messages import (
    CommandRequest,
    FollowerStepRequest,
    FollowerStepResponse,
    GetDiagnosticsRequest,
    GetPaintRequest,
    StartTraversalRequest,
    TraversalStatus,
)
from touchline.schemas.topics import Service, Topic

ROOT = Path(__file__).resolve().parents[2]
DOMAIN = 42
pytestmark = pytest.mark.xdist_group("ros2")  # by one worker, so that each process is started once
SHOWN = (*topics.TOPICS, *topics.VIEWING)
SERVED = (*topics.SERVICES, *topics.PARAMETER_SERVICES)
DECLARED: set[str] = set()  # services that the client calls or serves itself
READ = (topics.GNSS_FIX, topics.IMU, topics.ODOMETRY, topics.STATUS)
LENGTH_M = 400.0  # so long that no test sees its end
WAY = [
    Curve.from_line(start, end)
    for start, end in (((0, 0), (1, 0)), ((1, 0), (LENGTH_M - 1, 0)), ((LENGTH_M - 1, 0), (LENGTH_M, 0)))
]
PLAN = trajectory(WAY, [0, 1, 0], speed_mps=0.8)
REQUEST = StartTraversalRequest(trajectory=PLAN)


@dataclass
class System:
    """A robot, a gateway, and where they are met."""

    bus: Bus
    ros2_port: int
    definitions: Path

    @contextmanager
    def running(self, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
        """A service process."""
        command = [sys.executable, "-m", "touchline", *arguments]
        process = subprocess.Popen(command, cwd=ROOT, env={**os.environ, **self.bus.config.environment()})
        try:
            yield process
        finally:
            process.kill()
            process.wait()

    @contextmanager
    def gateway(self) -> Iterator[subprocess.Popen[bytes]]:
        """A bridge whose names are the robot's own, without its namespace."""
        where = ("--ros2-listen", f"tcp/127.0.0.1:{self.ros2_port}", "--ros-domain", str(DOMAIN))
        with self.running("bridge", "--ros2", *where, "--ros-namespace", "/") as process:
            until(self._bridge_answers)
            yield process

    def _bridge_answers(self) -> bool:
        try:
            self.bus.call(topics.diagnostics_service(topics.BRIDGE), GetDiagnosticsRequest())
        except CallError:
            return False
        return True

    def client(self) -> AbstractContextManager[ForeignClient]:
        """A foreign client that has met no gateway as yet."""
        return foreign_client(self.definitions, self.ros2_port, DOMAIN)

    def status(self) -> TraversalStatus:
        """The traversal's status as our own bus has it."""
        message = self.bus.inbox([topics.STATUS], keep="latest").wait(60.0)[-1].decode()
        assert isinstance(message, TraversalStatus)
        return message

    def state(self) -> int:
        """Its state."""
        return self.status().state


@pytest.fixture(scope="module")
def definitions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ros2") / "share"
    write_definitions(folder)
    return folder


@pytest.fixture(scope="module")
def system(definitions: Path) -> Iterator[System]:
    """Without a process as yet; the tests share what is started, and the last of them kills the gateway."""
    with Bus.open(topics.OPERATOR, BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")) as bus:
        yield System(bus, free_port(), definitions)


@pytest.fixture(scope="module")
def gateway(system: System) -> Iterator[subprocess.Popen[bytes]]:
    """Its process."""
    with system.gateway() as process:
        yield process


@pytest.fixture(scope="module")
def client(system: System, gateway: subprocess.Popen[bytes]) -> Iterator[ForeignClient]:
    """A foreign client."""
    with system.client() as it:
        yield it


@pytest.fixture(scope="module")
def robot(system: System) -> Iterator[System]:
    """With a robot that waits for a trajectory, four times as fast as a real one."""
    with system.running("robot-sim", "--seed", "5", "--speed", "4"):
        until(lambda: answers(system.bus), 400.0)  # after a change it compiles its kernels first
        yield system


def answers(bus: Bus) -> bool:
    """Readiness of the robot: its process takes orders later than that of its telemetry begins to answer."""
    try:
        bus.call(topics.GET_PAINT, GetPaintRequest())
        bus.call(topics.RESUME, CommandRequest())
    except CallError:
        return False
    return True


def until(condition: Callable[[], Any], timeout_s: float = 100.0, why: Callable[[], object] = str) -> Any:
    """Wait until a condition holds; in vain, `why` says what there is instead."""
    deadline = time.monotonic() + timeout_s
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited in vain: {why()}"
        time.sleep(0.05)
    return value


def listen(client: ForeignClient, read: Sequence[Topic]) -> None:
    for topic in read:
        qos = ":1:,1:,:,:,," if topic.latched else None
        client.do("listen", topic=f"/{topic.name}", type=topic.type.ros_type, qos=qos)


def call(client: ForeignClient, service: Service[Any, Any], **request: Any) -> dict[str, Any]:
    DECLARED.add(f"/{service.name}")
    answer = client.do("call", service=f"/{service.name}", type=service.ros_type, request=request)
    assert isinstance(answer, dict), "no response"
    return answer


def meet(client: ForeignClient) -> dict[str, Any]:
    """Wait until the client has discovered all that there is; it hears of it little by little."""

    def everything() -> dict[str, Any] | None:
        graph: dict[str, Any] = client.do("graph")
        whole = len(graph["topics"]) >= len(SHOWN) and len(graph["services"]) >= len(SERVED)
        return graph if whole and graph["nodes"] else None

    graph = until(everything)
    assert isinstance(graph, dict)
    return graph


def gateway_seen(client: ForeignClient) -> bool:
    """Return whether the client sees more of the gateway than it has declared itself, here or in a test before."""
    graph = client.do("graph")
    return (
        "/touchline" in graph["nodes"]
        or f"/{topics.PAINT.name}" in graph["topics"]
        or bool(graph["services"].keys() - DECLARED)
    )


def test_it_discovers_the_node_and_every_topic_and_service(client: ForeignClient) -> None:
    graph = meet(client)
    assert graph["nodes"] == ["/touchline"]
    published = {f"/{topic.name}": [topic.type.ros_type] for topic in SHOWN}
    assert graph["topics"] == {**published, "/goal_pose": ["geometry_msgs/msg/PoseStamped"]}
    named = {f"/{service.name.replace('-', '_')}": [service.ros_type] for service in SERVED}
    assert graph["services"] == {**named, "/follower/step": ["touchline_msgs/srv/FollowerStep"]}  # asked, not served
    assert "/trajectory_controller/start_traversal" in named


@pytest.mark.usefixtures("gateway")
def test_the_documented_example_lists_and_calls(system: System) -> None:
    command = [sys.executable, "examples/ros2_client.py", "pause", "--port", str(system.ros2_port), "--namespace", "/"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}
    done = subprocess.run(command, cwd=ROOT, env=environment, timeout=300, capture_output=True, text=True, check=False)
    assert "/gnss/fix  sensor_msgs/msg/NavSatFix\n" in done.stdout
    assert done.stdout.endswith("pause: False, nobody answers; the service does not run, or hangs\n")


@pytest.mark.usefixtures("gateway")
def test_it_follows_the_path_for_a_robot_that_asks(system: System, client: ForeignClient) -> None:
    DECLARED.add(f"/{topics.FOLLOWER_STEP.name}")
    client.do("follow", service=f"/{topics.FOLLOWER_STEP.name}", type=topics.FOLLOWER_STEP.ros_type, speed_mps=0.5)

    def step(number: int) -> FollowerStepResponse | None:
        try:
            return system.bus.call(topics.FOLLOWER_STEP, FollowerStepRequest(step=number, lateral_m=0.25))
        except CallError:
            return None

    until(lambda: step(1))
    for number in range(2, 20):
        assert step(number) == FollowerStepResponse(step=number, speed_mps=0.5, yaw_rate_radps=-0.25)


def goal_pose(x: float, y: float, heading: float, frame: str = "map") -> dict[str, Any]:
    """A message as RViz publishes it on a click."""
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * heading), "w": math.cos(0.5 * heading)}
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame},
        "pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turn},
    }


def test_it_drives_to_a_goal_that_is_published_and_to_one_from_the_command_line(
    robot: System, client: ForeignClient
) -> None:
    pose = {"topic": "/goal_pose", "type": "geometry_msgs/msg/PoseStamped"}
    with robot.running("planner"):
        assert not robot.bus.wait_for({topics.PLANNER}, 100.0)
        events = robot.bus.inbox([topics.EVENTS])
        meet(client)
        client.do("publish", **pose, message=goal_pose(3.0, 1.0, 0.5, frame="odom"))

        told: list[str] = []

        def refused() -> bool:
            told.extend(f"{event.code}: {event.text}" for _, event in events.messages())
            return any(text.startswith("goal-refused") and "'odom'" in text for text in told)

        def driven() -> bool:
            told.extend(f"{event.code}: {event.text}" for _, event in events.messages())
            return robot.state() == TraversalStatus.DONE

        until(refused)
        client.do("publish", **pose, message=goal_pose(3.0, 1.0, 0.5))
        until(driven, 200.0, lambda: (robot.status(), told))
        at = robot.bus.inbox([topics.ODOMETRY], keep="latest").wait(60.0)[-1].decode()
        assert math.hypot(at.pose.pose.position.x - 3.0, at.pose.pose.position.y - 1.0) < 0.03
        done = touchline("goto", "6", "1", "-0.5", "--json", config=robot.bus.config)
        told = figures(done)
        assert told["success"]
        assert told["arrival"]["true"]["off_m"] < 0.03
        assert abs(told["arrival"]["true"]["turned_deg"]) < 2.0
        assert told["arrival"]["time_s"]["taken"] == pytest.approx(told["arrival"]["time_s"]["planned"], abs=1.0)
        refused_goal = touchline("goto", "6", "5", "--duration", "0.1", "--json", config=robot.bus.config)
        assert refused_goal.returncode == 1
        assert "give at least" in refused_goal.stderr


def test_it_drives_the_robot_and_reads_what_our_own_bus_has(robot: System, client: ForeignClient) -> None:
    meet(client)
    listen(client, [topics.STATUS])
    (late,) = until(lambda: client.do("take")[f"/{topics.STATUS.name}"])  # said before it came
    assert late["state"] == robot.state()
    listen(client, READ[:-1])
    inbox = robot.bus.inbox(READ)
    assert answers(robot.bus)  # so it knows of the inbox, as it will of what the client listens to when that calls
    answer = call(client, topics.START_TRAVERSAL, **REQUEST.model_dump(mode="json"))
    assert answer["success"], (answer, robot.status())
    assert answer["total_time"] == pytest.approx(LENGTH_M / 0.8, rel=0.2)

    theirs: dict[str, list[Any]] = {f"/{topic.name}": [] for topic in READ}
    theirs[f"/{topics.STATUS.name}"] += [late]
    ours: dict[str, list[Any]] = {f"/{topic.name}": [] for topic in READ}

    def gather() -> dict[str, Any]:
        """Take what both have; returns the status that is theirs."""
        for topic, messages in client.do("take").items():
            theirs[topic] += messages
        for sample, message in inbox.messages():
            ours[f"/{sample.topic.name}"].append(message.model_dump(mode="json"))
        status: dict[str, Any] = theirs[f"/{topics.STATUS.name}"][-1]
        return status

    until(lambda: (now := gather())["state"] == TraversalStatus.RUNNING and now["arc_length_m"] > 2.0)
    assert call(client, topics.PAUSE, request_id="") == {"success": True, "message": "done"}
    until(lambda: robot.state() == TraversalStatus.PAUSED)
    until(lambda: gather()["state"] == TraversalStatus.PAUSED)
    refused = call(client, topics.START, request_id="")
    assert not refused["success"]
    assert "paused" in refused["message"]
    assert call(client, topics.ABORT, request_id="")["success"]
    gather()
    (painted,) = robot.bus.call(topics.GET_PAINT, GetPaintRequest()).strokes
    (stroke,) = call(client, topics.GET_PAINT, request_id="")["strokes"]
    settled = painted.x_m[:-1].tolist()  # the last drops may still be falling
    assert stroke["x_m"][: len(settled)] == settled != []

    for topic in READ:
        read, said = theirs[f"/{topic.name}"], ours[f"/{topic.name}"]
        both = [message for message in read if message in said]  # ours takes a change of state that overtakes
        assert len(both) > topic.rate_hz, topic.name  # more than a second of it
        assert len(both) >= min(len(read), len(said)) - 3, topic.name


def test_when_the_gateway_dies_its_tokens_go_and_the_robot_drives_on(
    robot: System, gateway: subprocess.Popen[bytes], client: ForeignClient
) -> None:
    meet(client)
    listen(client, [topics.STATUS])
    start = REQUEST.model_dump(mode="json")
    until(lambda: call(client, topics.START_TRAVERSAL, **start)["success"], why=robot.status)  # it may still be braking
    gateway.kill()
    until(lambda: not gateway_seen(client))
    assert robot.state() == TraversalStatus.RUNNING
    with robot.gateway():
        client.do("take")
        until(lambda: client.do("take")[f"/{topics.STATUS.name}"])
        assert robot.state() == TraversalStatus.RUNNING
        assert call(client, topics.ABORT, request_id="")["success"]
