"""Attacks that any program can make on an open bus, as docs/explanation/security.md says."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import zenoh

from touchline.bus import Bus, BusConfig, CallError
from touchline.bus.presence import token_prefix
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode

ASKED = m.CommandRequest(request_id="asked once")


@pytest.fixture
def stranger(bus_config: BusConfig) -> Iterator[zenoh.Session]:
    """A program that has nothing but the address."""
    with zenoh.open(bus_config.zenoh()) as session:
        yield session


@contextmanager
def robot(config: BusConfig) -> Iterator[list[m.CommandRequest]]:
    """Serve the emergency stop as the robot does; yield the requests."""
    served, done = [], threading.Event()
    with Bus.open(topics.ROBOT_SIM, config) as bus:
        server = bus.serve(topics.ESTOP)

        def serve() -> None:
            while not done.is_set():
                if (call := server.wait(0.05)) is not None:
                    served.append(call.request)
                    call.reply(m.CommandResponse(success=True, message="robot"))

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield served
        finally:
            done.set()
            thread.join()


def test_anybody_stops_a_robot_and_a_recorded_request_is_carried_out_once(bus_config, stranger):
    with robot(bus_config) as served:
        time.sleep(0.5)
        for _ in range(3):
            replies = stranger.get(f"{bus_config.namespace}/{topics.ESTOP.name}", payload=encode(ASKED))
            assert [reply.ok is not None for reply in replies] == [True]
        assert served == [ASKED]


def test_anybody_forges_what_a_robot_says(bus_config, stranger):
    with Bus.open(topics.BRIDGE, bus_config) as bus:
        inbox = bus.inbox([topics.CLOCK])
        time.sleep(0.5)
        stranger.put(f"{bus_config.namespace}/{topics.CLOCK.name}", encode(m.Clock(clock=m.Time(sec=7))))
        [sample] = inbox.wait(5.0)
        assert sample.decode() == m.Clock(clock=m.Time(sec=7))


def test_answers_in_a_robots_name_take_a_token_that_anybody_can_declare(bus_config, stranger):
    answer = encode(m.CommandResponse(success=True, message="stranger"))
    stranger.declare_queryable(
        f"{bus_config.namespace}/{topics.ESTOP.name}",
        lambda query: query.reply(query.key_expr, answer),
        complete=True,
    )
    with Bus.open(topics.OPERATOR, bus_config) as bus:
        with pytest.raises(CallError, match="only a session that is not robot-sim answers"):
            bus.call(topics.ESTOP, ASKED)
        token = f"{token_prefix(bus_config.namespace)}/{topics.ROBOT_SIM}/{stranger.zid()}"
        with stranger.liveliness().declare_token(token):
            time.sleep(0.5)
            assert bus.call(topics.ESTOP, ASKED).message == "stranger"
