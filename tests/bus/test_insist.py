"""Orders that cannot wait: repeated by two ways at once until they are acknowledged."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import CommandRequest
from touchline.services.bus import Bus, BusConfig, CallError, UrgentOrder, insist

# Says how many requests it has had. Given an argument, it can open no other connection once the first peer has come, as
# a robot does among its services that has no descriptors left.
ROBOT = """
import resource, sys
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import CommandRequest, CommandResponse
from touchline.services.bus import Bus

with Bus.open(topics.ROBOT_SIM) as bus:
    server, asked = bus.serve(topics.ESTOP), 0
    presence = bus.presence()
    decode(CommandRequest, encode(CommandRequest()))  # opens files for the first time
    print("ready", flush=True)
    while sys.argv[1:] and "bridge" not in presence.alive():
        presence.poll()
    if sys.argv[1:]:
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))  # none that may come free, either
        print("full", flush=True)
    while True:
        if (call := server.wait(0.01)) is not None:
            asked += 1
            call.reply(CommandResponse(success=True, message=f"request {asked}"))
"""


@contextmanager
def robot(bus_config, *arguments):
    environment = {**os.environ, **bus_config.environment()}
    command = [sys.executable, "-c", ROBOT, *arguments]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.send_signal(signal.SIGCONT)
            process.kill()


def estop(config, patience_s=30.0, tell=lambda problem: None):
    order = UrgentOrder(topics.ESTOP, CommandRequest(request_id="stop"), patience_s)
    ((namespace, answer),) = insist(order, topics.OPERATOR, config, tell)
    assert namespace == config.namespace
    return answer


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs to know how many files are open")
def test_a_robot_without_room_for_another_peer_is_reached_at_its_door(bus_config, monkeypatch):
    monkeypatch.setattr("touchline.services.bus.joining._GIVE_UP_S", 1.0)
    with robot(bus_config, "full") as process, Bus.open(topics.BRIDGE, bus_config):
        assert process.stdout.readline() == "full\n"
        with pytest.raises(TouchlineError, match="does not answer"), Bus.open(topics.OPERATOR, bus_config):
            pass
        assert estop(bus_config).message == "request 1"


def test_an_order_to_a_frozen_robot_is_told_and_carried_out_once_when_it_goes_on(bus_config):
    told = []
    with robot(bus_config) as process:
        process.send_signal(signal.SIGSTOP)

        def tell(problem):
            told.append(problem)
            process.send_signal(signal.SIGCONT)

        assert estop(bus_config, tell=tell).message == "request 1"
        assert told == ["robot-sim has not answered"]
        with Bus.open(topics.OPERATOR, bus_config) as bus:  # repeats of the order got the first one's answer
            assert bus.call(topics.ESTOP, CommandRequest(request_id="another")).message == "request 2"


def stop_everyone(config, patience_s=30.0, tell=lambda problem: None):
    order = UrgentOrder(topics.ESTOP, CommandRequest(request_id="stop"), patience_s, everyone=True)
    return {namespace: answer.message for namespace, answer in insist(order, topics.OPERATOR, config, tell)}


def test_an_order_for_everyone_reaches_robots_that_nobody_has_named(bus_config):
    with robot(bus_config.of("r1")), robot(bus_config.of("club/r2")), robot(bus_config):
        said = stop_everyone(bus_config)
        assert said == dict.fromkeys(("r1", "club/r2", "tt2"), "request 1")


def test_a_robot_that_is_not_there_is_not_waited_for_when_others_are(bus_config):
    with robot(bus_config.of("r1")):
        assert stop_everyone(bus_config) == {"r1": "request 1"}
    with pytest.raises(CallError, match=r"NOT ACKNOWLEDGED within 1 s"):
        stop_everyone(bus_config, 1.0)


def test_a_frozen_robot_holds_up_no_other_and_is_stopped_when_it_goes_on(bus_config):
    with robot(bus_config.of("r2")), robot(bus_config.of("r1")) as frozen:
        frozen.send_signal(signal.SIGSTOP)
        order = UrgentOrder(topics.ESTOP, CommandRequest(request_id="stop"), 60.0, everyone=True)
        answers = insist(order, topics.OPERATOR, bus_config.of("r1", "r2"), lambda problem: None)
        assert next(answers)[0] == "r2"
        frozen.send_signal(signal.SIGCONT)
        assert next(answers)[0] == "r1"
        assert list(answers) == []


def test_a_configuration_that_leads_elsewhere_has_no_door(tmp_path, bus_config):
    path = tmp_path / "zenoh.json5"
    path.write_text('{connect: {endpoints: ["tcp/127.0.0.1:1"]}}')
    assert BusConfig(endpoint=bus_config.endpoint, config_file=path).at_door() is None
    assert BusConfig(endpoint="unixpipe/meeting").at_door() is None
    assert bus_config.at_door() is not None
