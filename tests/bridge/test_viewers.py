"""Robot, bridge and replay as processes over Zenoh, and a viewer by others that looks at them (`viewer_client`)."""

import json
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from tests.bridge.viewer_client import ViewerClient, viewer
from tests.meeting import eventually
from tests.robot_sim.scripted import trajectory
from tests.system.commands import start_touchline
from touchline.bus import Bus, BusConfig, CallError
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.cdr import encode, full_definition
from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import (
    CommandRequest,
    GetDiagnosticsRequest,
    LoadRequest,
    Obstacle,
    Obstacles,
    PlanRequest,
    SetSpeedRequest,
    TraversalStatus,
)
from touchline.services.bridge.foxglove import FoxgloveConfig, serve_viewers

pytestmark = pytest.mark.xdist_group("viewers")  # by one worker, so that each process is started once
SQUARE = Path(__file__).resolve().parents[2] / "examples" / "sessions" / "square.mcap"
LENGTH_M = 400.0  # so long that no test sees its end
WAY = [Curve.from_line((a, 0.0), (b, 0.0)) for a, b in ((0.0, 1.0), (1.0, LENGTH_M - 1), (LENGTH_M - 1, LENGTH_M))]
TEMPLATE = {"name": "row", "segments": [{"id": "s1", "line": {"start": [1, 0], "end": [LENGTH_M - 1, 0]}}]}
ROBOTS = ("r1", "r2")  # the second is replayed
WORK = ("/r1/truth/ground/markers", "/r1/truth/ground/latest_markers")


class System:
    """A robot that drives, too fast for its watchdog to mind a busy machine, and a bridge that shows it and another."""

    def __init__(self, bus: Bus, folder: Path) -> None:
        self.bus = bus
        self.folder = folder
        self.log = folder / "bridge.log"
        here, both = bus.config, bus.config.of(*ROBOTS)
        self.processes = [
            start_touchline("robot-sim", "--seed", "5", "--speed", "2", config=here, log=folder / "robot.log"),
            start_touchline(
                *("bridge", "--foxglove", "--foxglove-listen", "127.0.0.1:0", "--foxglove-orders", "--clock"),
                config=both,
                log=self.log,
            ),
        ]
        assert eventually(lambda: " at ws://" in self.log.read_text(encoding="utf-8")), self.log.read_text()
        self.url = self.log.read_text(encoding="utf-8").split(" at ")[1].split()[0]
        load = LoadRequest(trajectory=trajectory(WAY, [0, 1, 0], speed_mps=0.8), template_json=json.dumps(TEMPLATE))
        assert eventually(lambda: self._takes(load), 400.0)  # after a change the robot compiles its kernels first
        assert bus.call(topics.START, CommandRequest(), 60.0).success

    def _takes(self, load: LoadRequest) -> bool:
        try:
            return self.bus.call(topics.LOAD, load, 60.0).success
        except CallError:
            return False

    def figure(self, name: str) -> str:
        """One of the bridge's."""
        answer = self.bus.call(topics.diagnostics_service(topics.BRIDGE), GetDiagnosticsRequest(), 60.0)
        return next(entry.value for entry in answer.diagnostics.status[0].values if entry.key == name)


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}", namespaces=ROBOTS[:1])
    with Bus.open(topics.OPERATOR, config) as bus:
        system = System(bus, tmp_path_factory.mktemp("viewers"))
        try:
            yield system
        finally:
            for process in system.processes:
                process.kill()
                process.wait()


@pytest.fixture
def client(system: System) -> Iterator[ViewerClient]:
    with viewer(system.url) as client:
        yield client


def state(client: ViewerClient, wanted: int) -> Callable[[], bool]:
    """Return whether the last status that a viewer has heard has this state."""
    return lambda: (
        client.of("/r1/traversal/status")[-1:] != []
        and (client.decoded(client.of("/r1/traversal/status")[-1]).state == wanted)
    )


def test_topics_and_services_of_every_robot_are_offered_with_their_schemas(client: ViewerClient) -> None:
    shown = (*topics.TOPICS, *topics.VIEWING)
    served = (*topics.SERVICES, *topics.REPLAY_SERVICES)
    client.until(lambda: len(client.channels) == 2 * len(shown) + 1 and len(client.services) == 2 * len(served))
    for robot in ROBOTS:
        for topic in shown:
            channel = client.channels[f"/{robot}/{topic.name}"]
            assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
            assert (channel["schemaName"], channel["schema"]) == (topic.type.ros_type, full_definition(topic.type))
        for service in served:
            offered = client.services[f"/{robot}/{service.name.replace('-', '_')}"]
            assert offered["type"] == service.ros_type
            assert offered["response"]["schema"] == full_definition(service.response)
    assert client.channels["/clock"]["schemaName"] == "rosgraph_msgs/msg/Clock"
    assert "playbackControl" not in client.server["capabilities"]


def test_bytes_are_those_of_the_bus_and_transforms_those_of_the_odometry(system: System, client: ViewerClient) -> None:
    inbox = system.bus.inbox([topics.ODOMETRY])
    client.subscribe("/r1/odometry/filtered", "/r1/tf", "/clock")
    client.until(lambda: len(client.of("/r1/odometry/filtered")) > 40 and client.of("/r1/tf") and client.of("/clock"))
    on_bus = {sample.payload for sample in inbox.drain()}
    passed = client.of("/r1/odometry/filtered")[1:]  # the first may have been sent before the inbox was there
    assert {each.payload for each in passed[5:-5]} <= on_bus
    told = {str(message.header.stamp): message.pose.pose for message in map(client.decoded, passed)}
    shared = [moved for each in client.of("/r1/tf") for moved in client.decoded(each).transforms]
    shared = [moved for moved in shared if str(moved.header.stamp) in told]
    assert shared
    for moved in shared:
        assert (moved.header.frame_id, moved.child_frame_id) == ("map", "r1/base_link")
        assert moved.transform.translation.x == told[str(moved.header.stamp)].position.x
        assert str(moved.transform.rotation) == str(told[str(moved.header.stamp)].orientation)
    times_ns = [each.time_ns for each in client.of("/r1/odometry/filtered")]
    assert times_ns == sorted(times_ns)
    client.until(lambda: client.times_ns)
    assert client.times_ns[-1] <= client.of("/r1/odometry/filtered")[-1].time_ns + 10**9


def test_who_comes_late_gets_what_was_told_once_and_all_paint(system: System, client: ViewerClient) -> None:
    kept = ("setup", "template", "plan", "plan/path", "tf_static", "template/markers", "body/markers")
    for late in (client, None):  # the second comes while the first one looks
        with viewer(system.url) as other:
            now = late or other
            now.subscribe(*(f"/r1/{name}" for name in kept), *WORK, "/r1/odometry/filtered")
            found = {name: now.decoded(now.first(f"/r1/{name}")) for name in kept}
            assert json.loads(found["template"].data)["name"] == "row"
            assert {each.child_frame_id for each in found["tf_static"].transforms} >= {"r1/gnss_link", "r1/tool_link"}
            assert found["plan/path"].poses[-1].pose.position.x == LENGTH_M
            assert {each.ns for each in found["template/markers"].markers if each.action == 0} == {"lines"}
            # The two topics of one drawing arrive one after the other.
            now.until(lambda now=now: covered_m(now) > 1.2 and covered_m(now, min) == pytest.approx(1.0, abs=0.1))
            now.until(lambda now=now: now.of("/r1/odometry/filtered"))
            at_m = now.decoded(now.of("/r1/odometry/filtered")[-1]).pose.pose.position.x
            assert covered_m(now) <= at_m + 1.0


def covered_m(client: ViewerClient, most: Callable[..., float] = max) -> float:
    """The x up to which a viewer has been shown paint, by the last message of both topics; or from which on."""
    last = [client.decoded(client.of(topic)[-1]) for topic in WORK if client.of(topic)]
    return most((point.x for array in last for each in array.markers for point in each.points), default=0.0)


def test_obstacles_are_shown(system: System, client: ViewerClient) -> None:
    client.subscribe("/r1/obstacles/markers")
    client.until(lambda: "obstacles" in system.figure("foxglove_topics").split(", "))
    corners = {"outline_x_m": np.array((1.0, 2.0, 2.0)), "outline_y_m": np.array((1.0, 1.0, 2.0))}
    seen = Obstacles(obstacles=(Obstacle(id=1, kind="person", **corners),))
    system.bus.publisher(topics.OBSTACLES).send(seen)
    (marker,) = client.decoded(client.first("/r1/obstacles/markers")).markers
    assert [(point.x, point.y) for point in marker.points[::2]] == [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)]


def test_orders_are_services_and_answers_are_the_robots(client: ViewerClient) -> None:
    client.subscribe("/r1/traversal/status")
    client.until(state(client, TraversalStatus.RUNNING))
    assert client.call("/r1/traversal/pause", request_id="p").success
    client.until(state(client, TraversalStatus.PAUSED))
    refused = client.call("/r1/traversal/start", request_id="q")
    assert not refused.success
    assert "cannot start while paused" in refused.message
    assert client.call("/r1/traversal/resume", request_id="r").success
    client.until(state(client, TraversalStatus.RUNNING))
    nobody = client.call("/r2/traversal/pause", request_id="s")
    assert not nobody.success
    assert "nobody answers" in nobody.message
    assert "nobody answers" in client.call("/r2/truth/get_paint", request_id="t")  # its response could not say so
    assert "not a CDR message" in client.call_bytes("/r1/truth/get_paint", b"\0\1\0\0\xff")


def test_parameters_are_told_and_cannot_be_set(client: ViewerClient) -> None:
    name = "/r1/touchline.scenario.seed"
    client.say(op="getParameters", parameterNames=[], id="all")
    while name not in client.until(lambda: client.parameters):  # until the bridge has heard the robot's setup
        client.parameters.clear()
        client.say(op="getParameters", parameterNames=[], id="all")
    assert client.parameters[name] == 5
    client.say(op="setParameters", parameters=[{"name": name, "value": 6}], id="set")
    client.until(lambda: any("read-only" in told.get("message", "") for told in client.told))
    client.parameters.clear()
    client.say(op="getParameters", parameterNames=[name], id="one")
    assert client.until(lambda: client.parameters) == {name: 5}


def test_nothing_is_taken_from_the_bus_for_nobody(system: System) -> None:
    with viewer(system.url) as client:
        client.subscribe("/r1/imu/data_raw", *WORK)
        client.first("/r1/imu/data_raw")
        client.unsubscribe("/r1/imu/data_raw")
        client.until(lambda: system.figure("foxglove_topics") == "clock, setup, template, truth/paint")
    assert eventually(lambda: system.figure("foxglove_topics") == "clock, setup")


def test_a_viewer_that_takes_nothing_holds_up_nobody(system: System) -> None:
    assert system.bus.call(topics.SET_SPEED, SetSpeedRequest(factor=20.0), 60.0).success
    with viewer(system.url) as frozen, viewer(system.url) as client:
        frozen.subscribe(*(f"/r1/{topic.name}" for topic in topics.TOPICS))
        client.subscribe("/r1/clock")
        sent = int(system.figure("foxglove_messages"))
        client.until(lambda: int(system.figure("foxglove_messages")) > sent + 8000)  # far more than wait for one
        heard = len(client.of("/r1/clock"))
        client.until(lambda: len(client.of("/r1/clock")) > heard)
        assert system.figure("lost") == "0"
    assert system.bus.call(topics.SET_SPEED, SetSpeedRequest(factor=2.0), 60.0).success


def test_an_address_that_is_taken_or_none_is_refused_in_a_line(system: System, monkeypatch: Any) -> None:
    port = system.url.rpartition(":")[2]
    taken = rf"--foxglove-listen 127.0.0.1:{port}: cannot listen there \(Address already in use"
    with pytest.raises(TouchlineError, match=taken), serve_viewers([system.bus], FoxgloveConfig(f"127.0.0.1:{port}")):
        pass
    for wrong in ("8765", "localhost:", "localhost:70000", ":8765"):
        with pytest.raises(SpecError, match="give HOST:PORT"):
            FoxgloveConfig(wrong)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(TouchlineError, match=r"--foxglove needs .* pip install 'foxglove-sdk"):
        serve_viewers([system.bus], FoxgloveConfig())


def test_a_replay_is_played_paused_and_sought_by_the_viewer(system: System) -> None:
    config = system.bus.config.of("r2")
    log = system.folder / "replay.log"
    replay = start_touchline("replay", str(SQUARE), "--paused", "--stay", "--json", config=config, log=log)
    system.processes.append(replay)

    def playable() -> tuple[int, ...] | None:
        """From and to, in ns; none if nothing is, and None while it is served anew."""
        try:
            with viewer(system.url) as client:
                ends = [client.server.get(key) for key in ("dataStartTime", "dataEndTime")]
        except (OSError, ConnectionClosed):
            return None
        return tuple(end["sec"] * 10**9 + end["nsec"] for end in ends if end is not None)

    assert eventually(lambda: bool(playable())), log.read_text()
    begin_ns, end_ns = playable() or (0, 0)
    assert end_ns - begin_ns > 10 * 10**9
    with viewer(system.url) as client:
        assert "playbackControl" in client.server["capabilities"]
        client.subscribe("/r2/traversal/status", "/r2/tf", *(name.replace("r1", "r2") for name in WORK))
        client.control(play=False, seek_ns=end_ns - 10**9)
        client.until(lambda: client.playback and client.playback[-1].did_seek)
        assert client.playback[-1].time_ns == end_ns - 10**9
        painted = client.until(lambda: client.of("/r2/truth/ground/markers"))
        client.until(lambda: any(each.points for each in client.decoded(client.of(painted[0].topic)[-1]).markers))
        client.control(play=False, seek_ns=begin_ns + 10**9)
        client.until(lambda: client.playback[-1].time_ns < begin_ns + 2 * 10**9)
        client.control(play=True, speed=5.0)
        client.until(lambda: client.playback[-1].playing and client.playback[-1].speed == 5.0)
        heard = len(client.of("/r2/tf"))
        client.until(lambda: len(client.of("/r2/tf")) > heard + 5)
        assert client.decoded(client.of("/r2/tf")[-1]).transforms[0].child_frame_id == "r2/base_link"
        answer = client.call("/r2/replay/pause", request_id="p")
        assert answer.success
        client.until(lambda: not client.playback[-1].playing)
    replay.send_signal(signal.SIGINT)
    assert replay.wait(60) == 130
    assert eventually(lambda: playable() == ())


def test_it_ends_in_order_while_somebody_looks_and_waits_for_an_answer(system: System) -> None:
    bridge = system.processes[1]
    with Bus.open(topics.PLANNER, system.bus.config) as planner, viewer(system.url) as client:
        client.subscribe("/r1/setup")
        client.first("/r1/setup")
        server = planner.serve(topics.PLAN_SERVICE)
        client.ask("/r1/planner/plan", encode(PlanRequest()))
        assert eventually(lambda: server.poll() is not None)  # which is never answered
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(60) == 0
        with pytest.raises(ConnectionClosed):
            client.until(lambda: False)
    assert len(system.log.read_text(encoding="utf-8").splitlines()) == 1  # where it is found, and nothing else
