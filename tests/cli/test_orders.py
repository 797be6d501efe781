"""Orders from a shell, faults, the list of topics, and two sessions compared."""

import json
import threading

import pytest

from tests.bridge.said import messages, record
from touchline.bus import Bus, HealthReporter
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.plugins import FAULTS

WAY_ANSWERS = {"wait-on": topics.WAIT_ON, "go-round": topics.GO_ROUND, "leave-out": topics.LEAVE_OUT}


@pytest.fixture
def robot(bus_config, request, monkeypatch):
    """Robot that can pause, take any fault, and never start, or serves what a test wants; it keeps its requests.

    On a busy machine it answers later than a robot should: that is no reason to report that it does not.
    """
    monkeypatch.setattr("touchline.bus.urgent_order.REPORT_AFTER_S", 60.0)
    monkeypatch.setattr("touchline.bus.calls._DISCOVERY_S", 60.0)
    served = getattr(request, "param", (topics.PAUSE, topics.START, topics.LOAD, topics.INJECT_FAULT))
    asked, over, ready = [], threading.Event(), threading.Event()

    def serve():
        with Bus.open(topics.ROBOT_SIM, bus_config) as bus:
            servers = [bus.serve(service) for service in served]
            health = HealthReporter(bus)
            ready.set()
            while not over.wait(0.005):
                health.poll({"state": m.TraversalStatus.PAUSED if asked else m.TraversalStatus.RUNNING})
                for server in servers:
                    while (call := server.poll()) is not None:
                        asked.append((server.service.name, call.request))
                        good = server.service is not topics.START
                        message = "as you say" if good else "no plan is loaded"
                        call.reply(server.service.response(success=good, message=message))

    thread = threading.Thread(target=serve)
    thread.start()
    assert ready.wait(60.0)
    yield asked
    over.set()
    thread.join()


def test_orders_and_faults_reach_the_robot(touchline_on_bus, robot):
    assert touchline_on_bus("order", "pause") == (0, "pause: as you say\n", "")
    assert touchline_on_bus("order", "start") == (1, "", "start refused: no plan is loaded\n")
    assert touchline_on_bus("fault", '{"kind": "bumper", "duration_s": 0.5}')[0] == 0
    (name, request) = robot[-1]
    assert (name, json.loads(request.fault_json)["kind"]) == (topics.INJECT_FAULT.name, "bumper")
    assert len({request.request_id for _, request in robot}) == 3


@pytest.mark.parametrize("robot", [WAY_ANSWERS.values()], indirect=True)
def test_a_robot_that_waits_before_something_is_answered(touchline_on_bus, robot):
    for order, service in WAY_ANSWERS.items():
        assert touchline_on_bus("order", order) == (0, f"{order}: as you say\n", "")
        assert robot[-1][0] == service.name


def test_to_go_on_loads_what_the_robot_keeps_and_starts_it(touchline_on_bus, robot):
    code, out, err = touchline_on_bus("order", "go-on")
    assert (code, out, err) == (1, "", "go-on refused: no plan is loaded\n")
    (load, request), (start, _) = robot
    assert (load, start) == (topics.LOAD.name, topics.START.name)
    assert request.resume and not request.trajectory.path.segments


def test_orders_to_nobody_and_faults_that_are_none(touchline_on_bus):
    code, _, err = touchline_on_bus("order", "start")
    assert (code, "nobody answers" in err) == (2, True)
    code, _, err = touchline_on_bus("order", "estop", "--patience", "1.7")
    told, given_up = err.splitlines()
    assert (code, told.startswith("estop: NOT ACKNOWLEDGED")) == (2, True)
    assert "within 1.7 s" in given_up
    assert "nobody answers" in given_up
    code, _, err = touchline_on_bus("fault", '{"kind": "gremlins"}')
    assert (code, "kind is 'gremlins'; give one of gnss-outage" in err) == (2, True)


def test_commands_without_services_say_so(touchline_on_bus, tmp_path):
    code, _, err = touchline_on_bus("record", str(tmp_path / "x.mcap"))
    assert (code, "nobody answers" in err) == (2, True)
    code, out, _ = touchline_on_bus("status", "--json")
    (robot,) = json.loads(out)["robots"]
    assert (code, robot["traversal"]) == (1, None)
    assert {service["state"] for service in robot["services"]} == {"not on the bus"}
    assert "nothing was running" in touchline_on_bus("down")[1]


def test_every_topic_and_service_is_listed(touchline):
    code, out, _ = touchline("topics")
    assert code == 0
    assert all(row.name in out for row in (*topics.TOPICS, *topics.SERVICES))
    listed = json.loads(touchline("topics", "--json")[1])
    assert {row["type"] for row in listed["topics"]} == {topic.type.ros_type for topic in topics.TOPICS}
    assert m.PlanRequest.ros_type.removesuffix("_Request") in {row["type"] for row in listed["services"]}


def test_sessions_are_compared(touchline, tmp_path):
    one, again, other = (
        str(record(tmp_path / f"{name}.mcap", messages(200, rate_radps)).finish().path)
        for name, rate_radps in (("one", 0.5), ("again", 0.5), ("other", 0.6))
    )
    code, out, _ = touchline("compare", one, again)
    assert (code, out.splitlines()[-1]) == (0, "the sessions are identical")
    code, out, _ = touchline("compare", one, other, "--json")
    found = json.loads(out)
    assert code == 1
    assert not found["same"]
    assert found["topics"]["/tt2/clock"]["identical"] == 20
    assert found["topics"]["/tt2/imu/data_raw"]["different"] > 100
    code, out, _ = touchline("compare", one, other, "--topic", "/tt2/clock")
    assert (code, out.splitlines()[-1]) == (0, "the sessions are identical")
    code, out, err = touchline("compare", one, other, "--topic", "/tt2/clock", "--topic", "/tt2/plam")
    assert (code, out) == (2, "")
    assert "neither recording has a message of /tt2/plam" in err


def test_the_version_is_told(touchline):
    assert touchline("--version")[1].startswith("touchline 0.")


def test_the_kinds_of_faults_are_listed_with_their_parameters(touchline):
    code, out, _ = touchline("fault", "--list")
    assert code == 0
    rows = {row[0]: row[1:] for row in (line.split("\t") for line in out.splitlines()[1:])}
    assert tuple(rows) == FAULTS.names()
    assert rows["messages-lost"] == ["sensor, share (1.0)", "messages are lost"]
    code, out, _ = touchline("fault", "--list", "--json")
    listed = json.loads(out)
    assert [each["kind"] for each in listed] == list(FAULTS.names())
    assert listed[-1]["schema"]["properties"]["kind"]["const"] == "operator-lost"
    code, _, err = touchline("fault")
    assert code == 2 and "give one, or --list" in err
