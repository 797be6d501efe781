"""Orders that cannot wait: repeated by two ways at once until they are acknowledged."""

import os
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.meeting import eventually
from touchline.bus import (
    Bus,
    BusConfig,
    CallError,
    HealthReporter,
    StopProof,
    UrgentOrder,
    repeat_at_door,
    repeat_until_acknowledged,
)
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import CommandRequest, CommandResponse

# Says how many requests it has had. Given an argument, it can open no other connection once the first peer has come, as
# a robot does among its services that has no descriptors left.
ROBOT = """
import resource, sys
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import CommandRequest, CommandResponse
from touchline.schemas.messages import TraversalStatus
from touchline.bus import Bus, HealthReporter

with Bus.open(topics.ROBOT_SIM) as bus:
    server, health, asked = bus.serve(topics.ESTOP), HealthReporter(bus), 0
    presence = bus.presence()
    decode(CommandRequest, encode(CommandRequest()))  # opens files for the first time
    print("ready", flush=True)
    while sys.argv[1:] and "bridge" not in presence.alive():
        presence.poll()
    if sys.argv[1:]:
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))  # none that may come free, either
        print("full", flush=True)
    while True:
        health.poll({"state": TraversalStatus.ESTOPPED if asked else TraversalStatus.RUNNING})
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
    ((namespace, answer),) = repeat_until_acknowledged(order, topics.OPERATOR, config, tell)
    assert namespace == config.namespace
    return answer


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs to know how many files are open")
def test_a_robot_without_room_for_another_peer_is_reached_at_its_door(bus_config, monkeypatch):
    monkeypatch.setattr("touchline.bus.joining._ABORT_AFTER_S", 1.0)
    with robot(bus_config, "full") as process, Bus.open(topics.BRIDGE, bus_config):
        assert process.stdout.readline() == "full\n"
        with pytest.raises(TouchlineError, match="does not answer"), Bus.open(topics.OPERATOR, bus_config):
            pass
        assert estop(bus_config).message == "request 1"


def test_who_is_on_the_bus_sends_it_at_the_robots_door_too(bus_config):
    request = CommandRequest(request_id="stop")
    with robot(bus_config), Bus.open(topics.CONSOLE, bus_config) as bus:
        repeat_at_door(topics.ESTOP, request, bus.node, bus.config, threading.Event())
        assert bus.call(topics.ESTOP, request).message == "request 1"  # the answer that the door was given


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


@contextmanager
def stranger(bus_config, success, state):
    """Somebody who has the robot's name, too, and answers in its place."""
    done = threading.Event()

    def answer(bus, server, health):
        while not done.is_set():
            health.poll({"state": state})
            if (call := server.wait(0.01)) is not None:
                call.reply(CommandResponse(success=success, message="a stranger's"))

    with Bus.open(topics.ROBOT_SIM, bus_config) as bus:
        thread = threading.Thread(target=answer, args=(bus, bus.serve(topics.ESTOP), HealthReporter(bus)))
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()


@contextmanager
def telemetry(bus_config, state):
    """Publisher of the robot's status: a process of its own, which is not frozen with it."""
    with Bus.open(topics.TELEMETRY, bus_config) as bus:
        publisher = bus.publisher(topics.STATUS)
        publisher.send(m.TraversalStatus(state=state))
        yield publisher


def test_a_stranger_cannot_answer_for_a_frozen_robot(bus_config):
    """Nor with a state: whoever tells one of the robot has to say that it has stopped."""
    told, stopped = [], m.TraversalStatus.ESTOPPED
    with (
        Bus.open(topics.BRIDGE, bus_config),  # at the meeting point, so that the stranger is met
        robot(bus_config) as process,
        telemetry(bus_config, m.TraversalStatus.RUNNING) as status,
    ):
        process.send_signal(signal.SIGSTOP)
        for success in (False, True):
            with (
                stranger(bus_config, success, stopped),
                pytest.raises(CallError, match="does not report itself that it has stopped"),
            ):
                estop(bus_config, 4.0, told.append)
        with stranger(bus_config, True, stopped):
            status.send(m.TraversalStatus(state=stopped))
            process.send_signal(signal.SIGCONT)
            estop(bus_config)


def test_each_process_of_the_name_has_to_say_that_it_has_stopped(bus_config):
    """To who has been on the bus all the time, as a console, a frozen robot's token is known."""
    with Bus.open("test", bus_config) as bus, robot(bus_config) as process:
        for state in (m.TraversalStatus.RUNNING, m.TraversalStatus.ESTOPPED):
            with stranger(bus_config, True, state):
                proof = StopProof(bus)
                assert eventually(lambda: len(bus.sessions(topics.ROBOT_SIM)) == 2)
                bus.call(topics.ESTOP, CommandRequest(request_id=f"stop {state}"))
                stops = state != m.TraversalStatus.RUNNING
                stopped = eventually(
                    lambda proof=proof: proof.lacking(topics.ESTOP.name, 1.0) == "", 60.0 if stops else 1.0
                )
                assert stopped == stops
                if stops:
                    process.send_signal(signal.SIGSTOP)
                assert "one of 2 processes" in proof.lacking(topics.ESTOP.name, 1.0)
            assert eventually(lambda: len(bus.sessions(topics.ROBOT_SIM)) == 1)


def stop_everyone(config, patience_s=30.0, tell=lambda problem: None):
    order = UrgentOrder(topics.ESTOP, CommandRequest(request_id="stop"), patience_s, everyone=True)
    return {
        namespace: answer.message
        for namespace, answer in repeat_until_acknowledged(order, topics.OPERATOR, config, tell)
    }


def test_an_order_for_everyone_reaches_robots_that_nobody_has_named(bus_config):
    """And waits for the one that is named only if no other is there."""
    with robot(bus_config.of("r1")), robot(bus_config.of("club/r2")):
        assert stop_everyone(bus_config) == dict.fromkeys(("r1", "club/r2"), "request 1")
    with pytest.raises(CallError, match=r"NOT ACKNOWLEDGED within 1 s"):
        stop_everyone(bus_config, 1.0)


def test_a_frozen_robot_holds_up_no_other_and_is_stopped_when_it_goes_on(bus_config):
    with robot(bus_config.of("r2")), robot(bus_config.of("r1")) as frozen:
        frozen.send_signal(signal.SIGSTOP)
        order = UrgentOrder(topics.ESTOP, CommandRequest(request_id="stop"), 60.0, everyone=True)
        answers = repeat_until_acknowledged(order, topics.OPERATOR, bus_config.of("r1", "r2"), lambda problem: None)
        assert next(answers)[0] == "r2"
        frozen.send_signal(signal.SIGCONT)
        assert next(answers)[0] == "r1"
        assert list(answers) == []


def test_a_configuration_that_leads_elsewhere_has_no_door(tmp_path, bus_config):
    path = tmp_path / "zenoh.json5"
    path.write_text('{connect: {endpoints: ["tcp/127.0.0.1:1"]}}')
    assert BusConfig(endpoint=bus_config.endpoint, config_file=path).doors() == ()
    assert BusConfig(endpoint="unixpipe/meeting").doors() == ()
    assert len(bus_config.doors()) == 1
