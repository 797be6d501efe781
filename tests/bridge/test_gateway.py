"""The gateway in one process, against a plain Zenoh session that is set up as rmw_zenoh sets up a node's."""

import itertools
import json
import time
from dataclasses import replace

import pytest
import zenoh
from zenoh import ext, handlers

from tests.meeting import caught_up
from touchline.bus import Bus, CallError, attachment
from touchline.bus.ports import free_port
from touchline.bus.ros2 import Ros2Endpoint, Ros2Session
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages import (
    Clock,
    CommandRequest,
    CommandResponse,
    FollowerStepRequest,
    FollowerStepResponse,
    GetPaintRequest,
    GetParametersRequest,
    GetParametersResponse,
    Header,
    ListParametersRequest,
    ListParametersResponse,
    Odometry,
    String,
    TFMessage,
    Time,
)
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.services.bridge import routes
from touchline.services.bridge.gateway import Gateway, GatewayConfig, passing_urgent
from touchline.services.bridge.rmw_zenoh import RosNode, gid

#: Liveliness tokens of a gateway: of its node, its follower, each topic and service, and two for goals.
SHOWN = (*topics.TOPICS, *topics.VIEWING)
EVERYTHING = 2 + len(SHOWN) + len(topics.SERVICES) + len(topics.PARAMETER_SERVICES) + 2


@pytest.fixture
def endpoint():
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture
def robot(bus_config):
    with Bus.open(topics.ROBOT_SIM, bus_config) as bus:
        yield bus


@pytest.fixture
def bridge(robot):
    with Bus.open(topics.BRIDGE, robot.config) as bus:
        assert not bus.wait_for({topics.ROBOT_SIM}, 60.0)
        yield bus


@pytest.fixture
def session(endpoint):
    with Ros2Session.open(Ros2Endpoint(endpoint)) as session:
        yield session


@pytest.fixture
def gateway(bridge, session):
    gateway = Gateway(bridge, bridge, session, GatewayConfig(domain=3))
    with passing_urgent([gateway]):
        yield gateway


@pytest.fixture
def names(session):
    return RosNode(3, "/tt2", "touchline", session.id)


def zenoh_session(mode, *, connect=(), listen=("tcp/127.0.0.1:0",)):
    config = zenoh.Config()
    for key, value in {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "connect/endpoints": list(connect),
        "listen/endpoints": list(listen),
        "timestamping/enabled": True,
        "scouting/delay": 100,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


@pytest.fixture
def ros(gateway, endpoint):
    """A node's session, to which the gateway and all that it has is known."""
    with zenoh_session("peer", connect=[endpoint]) as ros:
        turn_until(gateway, lambda: len(tokens(ros)) == EVERYTHING)
        yield ros


def tokens(ros, domain=3):
    replies = ros.liveliness().get(f"@ros2_lv/{domain}/**", handlers.FifoChannel(256))
    return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}


def turn_until(gateway, condition, timeout_s=60.0):
    deadline = time.monotonic() + timeout_s
    while not (value := condition()):
        gateway.turn()
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.002)
    return value


def subscribe(ros, session, key):
    """A subscription that the gateway's session knows of: its token, declared later, has come there."""
    subscriber = ros.declare_subscriber(key, handlers.FifoChannel(10_000))
    token, deadline = f"@test/{key}", time.monotonic() + 60.0
    with ros.liveliness().declare_token(token):
        while not session.tokens(token):
            assert time.monotonic() < deadline, "waited in vain"
    return subscriber


def clock(seconds):
    return encode(Clock(clock=Time(sec=seconds)))


def send(ros, key, payload, number=1):
    """One request as rmw_zenoh sends it; where its replies come."""
    numbered = None if number is None else attachment.pack(number, time.time_ns(), b"c" * 16)
    target = zenoh.QueryTarget.ALL_COMPLETE
    return ros.get(key, handlers.FifoChannel(8), payload=payload, attachment=numbered, target=target)


def ask(ros, gateway, key, payload, number=1):
    """The only reply to one request."""
    replies, heard = send(ros, key, payload, number), []

    def ended():
        """Return whether no more replies will come, which may be known some time after the last one."""
        try:
            reply = replies.try_recv()
        except zenoh.ZError:
            return True
        heard.extend([] if reply is None else [reply])
        return False

    turn_until(gateway, ended)
    (reply,) = heard
    return reply


def test_a_message_passes_unchanged_with_number_time_and_the_publishers_id(robot, session, gateway, ros, names):
    key = names.topic_key(topics.CLOCK)
    heard = subscribe(ros, session, key)
    publisher = robot.publisher(topics.CLOCK)
    before_ns = time.time_ns()
    for second in range(3):
        publisher.send_bytes(clock(second))
    after_ns = time.time_ns()
    samples = [turn_until(gateway, heard.try_recv) for _ in range(3)]
    assert [sample.payload.to_bytes() for sample in samples] == [clock(second) for second in range(3)]
    said = [attachment.unpack(sample.attachment.to_bytes()) for sample in samples]
    assert [numbered.sequence for numbered in said] == [1, 2, 3]
    assert all(before_ns <= numbered.source_time_ns <= after_ns for numbered in said)
    (token,) = [token for token in tokens(ros) if "/%tt2%clock/" in token]
    assert {numbered.publisher for numbered in said} == {gid(token)}


def test_who_comes_late_is_given_the_last_message_of_a_latched_topic_only(robot, gateway, endpoint, names):
    latched = robot.publisher(topics.TEMPLATE)
    latched.send(String(data="first"))
    turn_until(gateway, lambda: gateway.figures()["ros2_messages"] == 1)
    latched.send(String(data="second"))
    robot.publisher(topics.CLOCK).send_bytes(clock(1))
    turn_until(gateway, lambda: gateway.figures()["ros2_messages"] == 3)
    with zenoh_session("peer", connect=[endpoint]) as late:
        history = ext.HistoryConfig(max_samples=1, detect_late_publishers=True)
        key = names.topic_key(topics.TEMPLATE)
        template = ext.declare_advanced_subscriber(late, key, handlers.FifoChannel(16), history=history)
        clocks = ext.declare_advanced_subscriber(
            late, names.topic_key(topics.CLOCK), handlers.FifoChannel(16), history=history
        )
        sample = turn_until(gateway, template.try_recv)
        assert decode(String, sample.payload.to_bytes()).data == "second"
        assert attachment.unpack(sample.attachment.to_bytes()).sequence == 2
        latched.send(String(data="third"))
        assert decode(String, turn_until(gateway, template.try_recv).payload.to_bytes()).data == "third"
        assert clocks.try_recv() is None


def test_what_viewers_draw_is_published_to_who_looks(robot, session, gateway, ros, names):
    robot.publisher(topics.SETUP).send(String(data=Setup(scenario=Scenario(seed=7)).model_dump_json()))
    odometry = robot.publisher(topics.ODOMETRY)
    odometry.send(Odometry(header=Header(frame_id="map", stamp=Time(sec=1))))
    turn_until(gateway, lambda: gateway.figures()["ros2_drawn"] == 3)  # of the setup; nobody looks at transforms
    transforms = subscribe(ros, session, names.topic_key(topics.TRANSFORMS))
    history = ext.HistoryConfig(max_samples=1, detect_late_publishers=True)
    key = names.topic_key(topics.STATIC_TRANSFORMS)
    fixed = ext.declare_advanced_subscriber(ros, key, handlers.FifoChannel(16), history=history)
    told = decode(TFMessage, turn_until(gateway, fixed.try_recv).payload.to_bytes())
    assert {each.child_frame_id for each in told.transforms} == {"gnss_link", "imu_link", "tool_link"}
    second = itertools.count(2)

    def moved():
        """A transform, once the gateway has seen that somebody looks."""
        odometry.send(Odometry(header=Header(frame_id="map", stamp=Time(sec=next(second)))))
        return transforms.try_recv()

    (transform,) = decode(TFMessage, turn_until(gateway, moved).payload.to_bytes()).transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "base_link")


def test_the_clock_is_told_by_the_name_that_nodes_expect_if_asked_for(robot, bridge, session, endpoint):
    gateway = Gateway(bridge, bridge, session, GatewayConfig(domain=3, clock=True))
    with zenoh_session("peer", connect=[endpoint]) as ros:
        turn_until(gateway, lambda: len(tokens(ros)) == EVERYTHING + 1)
        heard = subscribe(ros, session, RosNode(3, "", "x", session.id).topic_key(topics.CLOCK))
        publisher = robot.publisher(topics.CLOCK)
        caught_up(bridge, robot)
        publisher.send_bytes(clock(3))
        assert turn_until(gateway, heard.try_recv).payload.to_bytes() == clock(3)


def test_a_gateway_that_falls_behind_holds_up_nobody_and_says_what_it_dropped(robot, session, gateway, ros, names):
    heard = subscribe(ros, session, names.topic_key(topics.CLOCK))
    publisher = robot.publisher(topics.CLOCK)
    publisher.send_bytes(clock(0))
    turn_until(gateway, heard.try_recv)
    for second in range(1, 40_001):  # more than a lossless inbox takes before its publishers wait
        publisher.send_bytes(clock(second))
    turn_until(gateway, lambda: gateway.figures()["ros2_dropped"])
    sent, numbers = 40_000, []

    def newer():
        """Return whether one is heard that was sent since; the last of the others may have been dropped itself."""
        nonlocal sent
        sent += 1
        publisher.send_bytes(clock(sent))
        while (sample := heard.try_recv()) is not None:
            numbers.append(attachment.unpack(sample.attachment.to_bytes()).sequence)
            assert sample.payload.to_bytes() == clock(numbers[-1] - 1)
        return numbers and numbers[-1] > 40_001

    turn_until(gateway, newer)
    assert len(numbers) < numbers[-1] - 1  # the gap shows in the numbers


def test_a_request_and_its_response_pass_unchanged(robot, bridge, gateway, ros, names):
    server = robot.serve(topics.PAUSE)
    caught_up(bridge, robot)
    asked_ns = time.time_ns()
    replies = send(ros, names.service_key(topics.PAUSE), encode(CommandRequest(request_id="r")), 17)
    call = turn_until(gateway, server.poll)
    assert call.request == CommandRequest(request_id="r")
    assert gateway.figures()["ros2_calls"] == 1
    response = CommandResponse(success=True, message="so be it")
    call.reply(response)
    reply = turn_until(gateway, replies.try_recv)
    assert reply.ok.payload.to_bytes() == encode(response)
    echoed = attachment.unpack(reply.ok.attachment.to_bytes())
    assert (echoed.sequence, echoed.publisher) == (17, b"c" * 16)
    assert echoed.source_time_ns > asked_ns


def test_a_call_that_nobody_serves_is_answered_in_the_response_if_it_can_tell(gateway, ros, names):
    reply = ask(ros, gateway, names.service_key(topics.PAUSE), encode(CommandRequest()))
    told = decode(CommandResponse, reply.ok.payload.to_bytes())
    assert not told.success
    assert "nobody answers" in told.message
    reply = ask(ros, gateway, names.service_key(topics.GET_PAINT), encode(GetPaintRequest()))
    assert "nobody answers" in reply.err.payload.to_string()
    assert gateway.figures()["ros2_refused"] == 2


def test_a_service_that_comes_up_this_moment_is_waited_for(robot, gateway, ros, names, monkeypatch):
    monkeypatch.setattr(routes, "_DISCOVERY_S", 60.0)  # longer than any machine's moment
    replies = send(ros, names.service_key(topics.PAUSE), encode(CommandRequest()))
    turn_until(gateway, lambda: gateway.figures()["ros2_calls"])
    server = robot.serve(topics.PAUSE)
    turn_until(gateway, server.poll).reply(CommandResponse(success=True))
    assert decode(CommandResponse, turn_until(gateway, replies.try_recv).ok.payload.to_bytes()).success


def test_parameters_are_told_from_the_setup_and_junk_is_refused_and_counted(robot, bridge, gateway, ros, names):
    robot.publisher(topics.SETUP).send(String(data=Setup(scenario=Scenario(seed=7)).model_dump_json()))
    turn_until(gateway, lambda: gateway.figures()["ros2_messages"] == 1)
    list_them, get, *_, set_together = topics.PARAMETER_SERVICES
    asked = ask(
        ros, gateway, names.service_key(list_them), encode(ListParametersRequest(prefixes=("scenario",), depth=1))
    )
    found = decode(ListParametersResponse, asked.ok.payload.to_bytes()).result.names
    flat = ("charge", "docks", "faults", "multipath", "name", "noise", "objects", "seed", "sensors", "sky", "steel")
    assert found == tuple(f"scenario.{name}" for name in flat)
    asked = ask(ros, gateway, names.service_key(get), encode(GetParametersRequest(names=("scenario.seed",))))
    assert decode(GetParametersResponse, asked.ok.payload.to_bytes()).values[0].integer_value == 7
    for payload in (b"", b"\0\1\0\0\xff\xff\xff\xff", bytes(33 * 1024 * 1024)):
        assert ask(ros, gateway, names.service_key(set_together), payload).err is not None
    assert "attachment" in ask(ros, gateway, names.service_key(get), b"", None).err.payload.to_string()
    robot.publisher(topics.SETUP).send(String(data='{"scenario": {"seed": "junk"}}'))
    turn_until(gateway, lambda: gateway.figures()["ros2_messages"] == 2)
    asked = ask(ros, gateway, names.service_key(get), encode(GetParametersRequest(names=("scenario.seed",))))
    assert decode(GetParametersResponse, asked.ok.payload.to_bytes()).values[0].integer_value == 7
    assert bridge.counters.rejected == 5


def serve_steps(ros, names, answer):
    """A follower as a ROS 2 node: its server and its liveliness token; it answers each query with ``answer(query)``."""
    key = names.service_key(topics.FOLLOWER_STEP)
    server = ros.declare_queryable(key, answer, complete=True)
    token = RosNode(3, "/", "pilot", str(ros.zid())).server_token(
        1, replace(topics.FOLLOWER_STEP, name="/tt2/follower/step")
    )
    return server, ros.liveliness().declare_token(token)


def test_a_follower_of_ros_2_is_asked_as_long_as_it_is_there(robot, gateway, ros, names):
    asked = []

    def answer(query):
        asked.append(attachment.unpack(query.attachment.to_bytes()))
        request = decode(FollowerStepRequest, query.payload.to_bytes())
        if request.step == 3:
            query.reply_err(b"out of ideas")
        elif request.step == 4:
            query.reply(query.key_expr, b"junk", attachment=query.attachment)
        else:
            said = FollowerStepResponse(step=request.step, speed_mps=0.5, yaw_rate_radps=request.lateral_m)
            query.reply(query.key_expr, encode(said), attachment=query.attachment)

    def step(number, timeout_s=60.0):
        request = FollowerStepRequest(step=number, lateral_m=0.25)
        return robot.call(topics.FOLLOWER_STEP, request, timeout_s, gateway.turn)

    with pytest.raises(CallError, match="no answer within"):
        step(1, 0.1)
    server, token = serve_steps(ros, names, answer)
    assert step(2) == FollowerStepResponse(step=2, speed_mps=0.5, yaw_rate_radps=0.25)
    with pytest.raises(CallError, match="out of ideas"):
        step(3)
    with pytest.raises(PayloadError, match="FollowerStep_Response"):
        step(4)
    assert [numbered.sequence for numbered in asked] == [1, 2, 3]
    assert {numbered.publisher for numbered in asked} == {asked[0].publisher}
    server.undeclare()
    with pytest.raises(CallError, match="no answer from the ROS 2 node"):
        step(5)
    token.undeclare()

    def gone():
        with pytest.raises(CallError) as told:
            step(6, 0.1)
        return "no answer within" in str(told.value)

    turn_until(gateway, gone)


def test_a_stop_passes_while_the_loop_is_busy(robot, bridge, gateway, ros, names):
    server = robot.serve(topics.ESTOP)
    caught_up(bridge, robot)
    replies = send(ros, names.service_key(topics.ESTOP), encode(CommandRequest(request_id="1")))
    call = server.wait(60.0)  # nobody turns the gateway
    assert call is not None
    call.reply(CommandResponse(success=True, message="done"))
    assert decode(CommandResponse, replies.recv().ok.payload.to_bytes()).message == "done"


def test_a_gateway_that_can_pass_no_stops_on_does_not_go_on(gateway, monkeypatch):
    monkeypatch.setattr(routes.ServiceRoute, "turn", lambda route: 1 / 0 if route.urgent else None)
    with pytest.raises(ZeroDivisionError):
        turn_until(gateway, lambda: False)


def test_a_request_without_a_number_or_too_large_is_refused_and_counted(bridge, gateway, ros, names):
    key = names.service_key(topics.PAUSE)
    assert "attachment" in ask(ros, gateway, key, encode(CommandRequest()), None).err.payload.to_string()
    reply = ask(ros, gateway, key, bytes(33 * 1024 * 1024))
    assert "at most" in decode(CommandResponse, reply.ok.payload.to_bytes()).message
    assert bridge.counters.rejected == 2
    assert "traversal/pause" in bridge.counters.last_rejection


def test_foreign_traffic_does_not_reach_the_bus(robot, session, gateway, ros, names):
    inbox = robot.inbox([topics.CLOCK])
    heard = subscribe(ros, session, names.topic_key(topics.CLOCK))
    ros.put("tt2/clock", clock(666))
    ros.put(names.topic_key(topics.CLOCK), clock(666), attachment=attachment.pack(1, 1, b"x" * 16))
    robot.publisher(topics.CLOCK).send_bytes(clock(1))
    assert [turn_until(gateway, heard.try_recv).payload.to_bytes() for _ in range(2)] == [clock(666), clock(1)]
    assert [sample.payload for sample in inbox.drain()] == [clock(1)]


def test_nodes_find_each_other_by_the_gateway_as_by_rmw_zenohd(gateway, ros, endpoint):
    with zenoh_session("peer", connect=[endpoint]) as other:
        token = ros.liveliness().declare_token("@ros2_lv/3/x/0/0/NN/%/%/talker")
        heard = other.declare_subscriber("3/chatter", handlers.FifoChannel(16))
        turn_until(gateway, lambda: "@ros2_lv/3/x/0/0/NN/%/%/talker" in tokens(other))
        turn_until(gateway, lambda: ros.put("3/chatter", b"hello") or heard.try_recv())
        token.undeclare()


def test_all_is_gone_when_the_gateway_is(bridge, endpoint):
    with zenoh_session("router", listen=[endpoint]) as router:
        with Ros2Session.open(Ros2Endpoint(endpoint, listen=False)) as session:
            gateway = Gateway(bridge, bridge, session, GatewayConfig(domain=3))
            turn_until(gateway, lambda: len(tokens(router)) == EVERYTHING)
        deadline = time.monotonic() + 60.0
        while tokens(router):
            assert time.monotonic() < deadline, "waited in vain"


def test_only_what_is_listed_is_there(robot, bridge, session, endpoint):
    listed = GatewayConfig(domain=3, topics=("traversal/status", "tf_*"), services=("traversal/estop",))
    gateway = Gateway(bridge, bridge, session, listed)
    publisher = robot.publisher(topics.CLOCK)
    with zenoh_session("peer", connect=[endpoint]) as ros:
        turn_until(gateway, lambda: len(tokens(ros)) == 4)
        names = {(kind, name) for *_, kind, _, _, _, name, _, _, _ in (each.split("/") for each in tokens(ros))}
        assert {name for kind, name in names if kind == "MP"} == {"%tt2%traversal%status", "%tt2%tf_static"}
        assert {name for kind, name in names if kind == "SS"} == {"%tt2%traversal%estop"}
        turn_until(gateway, lambda: publisher.send(Clock()) or gateway.turn())
        assert not gateway.pass_urgent()
        assert gateway.figures()["ros2_messages"] == 0


def test_a_second_gateway_for_the_same_robot_is_refused_and_one_for_another_is_not(bridge, gateway, endpoint):
    with Ros2Session.open(Ros2Endpoint(endpoint, listen=False)) as session:
        with pytest.raises(TouchlineError, match=r"/tt2/touchline is there already in domain 3; choose .*--ros-domain"):
            Gateway(bridge, bridge, session, GatewayConfig(Ros2Endpoint(endpoint, listen=False), domain=3))
        Gateway(bridge, bridge, session, GatewayConfig(domain=3, namespace="/other"))
        Gateway(bridge, bridge, session, GatewayConfig(domain=4))


def test_an_endpoint_that_cannot_be_used_is_told_with_its_option(session, endpoint):
    busy = rf"--ros2-listen {endpoint}: cannot listen .* --ros2-connect {endpoint}"
    with pytest.raises(TouchlineError, match=busy), Ros2Session.open(Ros2Endpoint(endpoint)):
        pass


def test_nobody_at_the_router_is_told(endpoint, monkeypatch):
    monkeypatch.setattr("touchline.bus.ros2._CONNECT_TIMEOUT_MS", 300)
    expected = rf"--ros2-connect {endpoint}: nobody answers .*rmw_zenohd"
    with pytest.raises(TouchlineError, match=expected), Ros2Session.open(Ros2Endpoint(endpoint, listen=False)):
        pass


def test_several_robots_are_several_nodes_of_one_session(bus_config, session, endpoint):
    with Bus.open_all(topics.BRIDGE, bus_config.of("r1", "club/r2")) as buses:
        config = GatewayConfig(domain=3, namespace="/demo")
        names = [bus.namespace for bus in buses]
        gateways = [Gateway(bus, bus, session, config.of(bus.namespace, alone=False), names) for bus in buses]
        with zenoh_session("peer", connect=[endpoint]) as ros:
            every = 2 * (EVERYTHING - 1)  # goals have one name each
            found = turn_until(gateways[0], lambda: len(there := tokens(ros)) == every and there)
            ids = [tuple(token.split("/")[2:5]) for token in found]
            assert len(set(ids)) == every, "session, node and endpoint tell each from all others"
            nodes = {token.split("/")[-2] for token in found if "/NN/" in token}
            assert nodes == {"%demo%r1", "%demo%club%r2"}
            second = RosNode(3, "/demo/club/r2", "touchline", session.id, EVERYTHING)
            subscriber = subscribe(ros, session, second.topic_key(topics.CLOCK))
            caught_up(buses[1], buses[1])
            said = encode(Clock(clock=Time(sec=7)))
            buses[1].publisher(topics.CLOCK).send_bytes(said)
            sample = turn_until(gateways[1], subscriber.try_recv)
            assert sample.payload.to_bytes() == said
            assert not gateways[0].turn()


@pytest.mark.parametrize(
    ("given", "alone", "several"),
    [("", "r1", "r1"), ("/", "/", "r1"), ("demo", "demo", "demo/r1"), ("/a/b/", "/a/b/", "a/b/r1")],
)
def test_each_of_several_robots_has_its_name_below_the_one_that_is_given(given, alone, several):
    config = GatewayConfig(namespace=given)
    assert config.of("r1", alone=True).namespace == alone
    assert config.of("r1", alone=False).namespace == several
