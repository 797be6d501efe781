"""Presence, when strangers declare what they please and nobody looks for long."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from tests.meeting import caught_up, eventually
from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.bus.presence import Token, parse_token, token_prefix
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import Clock, Time

PREFIX = token_prefix("tt2")


@pytest.fixture
def bus(bus_config: BusConfig) -> Iterator[Bus]:
    with Bus.open("bridge", bus_config) as bus:
        yield bus


@pytest.fixture
def stranger(bus: Bus) -> Iterator[zenoh.Session]:
    """A peer that does not keep to our names."""
    with zenoh.open(bus.config.zenoh()) as session:
        yield session


OF_ANOTHER_SHAPE = (
    PREFIX,
    f"{PREFIX}/robot-sim",
    f"{PREFIX}/robot-sim/ab/cd",
    f"{PREFIX}/robot-sim/not hexadecimal",
    f"{PREFIX}/\x1b]52;c;aGk=\x07/ab",
    f"{PREFIX}/{'x' * 300}/ab",
    "@touchline/another/robot-sim/ab",
)


def test_tokens_of_another_shape_say_nothing(bus, stranger):
    presence = bus.presence()
    with ExitStack() as stack:
        for key in (*OF_ANOTHER_SHAPE, f"{PREFIX}/somebody/ab"):
            stack.enter_context(stranger.liveliness().declare_token(key))
        assert eventually(lambda: "somebody" in (presence.poll(), presence.alive())[1])
        assert presence.alive() == {"bridge", "somebody"}
    assert eventually(lambda: (presence.poll(), presence.alive())[1] == {"bridge"})


@given(st.text() | st.lists(st.text(alphabet="/@ab0-* \x1b")).map("/".join))
def test_every_key_is_a_token_or_none(rest):
    token = parse_token(f"{PREFIX}/{rest}", PREFIX)
    assert token is None or f"{token.node}/{token.instance}" == rest
    assert parse_token(rest, PREFIX) is None


def test_a_token_is_read():
    assert parse_token(f"{PREFIX}/robot-sim/1f0", PREFIX) == Token("robot-sim", "1f0")


def test_many_visits_that_nobody_looks_at_hold_nobody_up(bus, bus_config):
    """A full channel of one subscription blocks Zenoh's receiving thread, and with it everything else."""
    presence = bus.presence()
    with Bus.open("robot-sim", bus_config) as robot:
        inbox, publisher = bus.inbox([topics.CLOCK]), robot.publisher(topics.CLOCK)
        caught_up(robot, bus)
        session = robot._session
        stays = [session.liveliness().declare_token(f"{PREFIX}/early/{number:x}") for number in range(3)]
        leaves = session.liveliness().declare_token(f"{PREFIX}/gone/1")
        assert eventually(lambda: {"early", "gone"} <= (presence.poll(), presence.alive())[1])
        leaves.undeclare()
        for number in range(1500):
            session.liveliness().declare_token(f"{PREFIX}/visitor/{number:x}").undeclare()
        late = session.liveliness().declare_token(f"{PREFIX}/late/1")
        publisher.send(Clock(clock=Time(sec=1)))
        assert [sample.decode() for sample in inbox.wait(60.0)] == [Clock(clock=Time(sec=1))]
        expected = {"bridge", "robot-sim", "early", "late"}
        assert eventually(lambda: (presence.poll(), presence.alive())[1] == expected), presence.alive()
        stays[0].undeclare()
        stays[1].undeclare()
        late.undeclare()
        assert eventually(lambda: (presence.poll(), presence.alive())[1] == expected - {"late"})
        stays[2].undeclare()
        assert eventually(lambda: (presence.poll(), presence.alive())[1] == {"bridge", "robot-sim"})


@contextmanager
def serving(bus: Bus) -> Iterator[None]:
    """The bus's process in its loop: it answers how it is."""
    health, done = HealthReporter(bus), threading.Event()

    def loop() -> None:
        while not done.wait(0.002):
            health.poll({})

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def test_two_planners_on_one_bus_are_refused(bus_config):
    with Bus.open("planner", bus_config) as first:
        first.claim()
        with (
            serving(first),
            Bus.open("planner", bus_config) as second,
            pytest.raises(TouchlineError, match="already running"),
        ):
            second.claim()
        first.claim()


def test_of_two_planners_that_claim_their_name_at_once_one_gets_it(bus_config):
    outcomes: list[str] = []
    ready = threading.Barrier(2)

    def claim(bus: Bus) -> None:
        ready.wait()
        try:
            bus.claim()
        except TouchlineError:
            outcomes.append("refused")
        else:
            outcomes.append("claimed")

    with Bus.open("planner", bus_config) as one, Bus.open("planner", bus_config) as other:
        caught_up(one, other)
        threads = [threading.Thread(target=claim, args=(bus,)) for bus in (one, other)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert sorted(outcomes) == ["claimed", "refused"]


def test_a_strangers_token_does_not_keep_the_robot_from_starting(bus, bus_config, stranger, caplog):
    events = bus.inbox([topics.SUPERVISOR_EVENTS])
    token = f"{PREFIX}/robot-sim/{stranger.zid()}"
    with stranger.liveliness().declare_token(token), Bus.open("robot-sim", bus_config) as robot:
        caught_up(robot, bus)
        robot.claim()
        (event,) = [sample.decode() for sample in events.wait(60.0)]
    assert (event.source, event.code) == ("robot-sim", "namesake")
    assert str(stranger.zid()) in event.text
    assert "did not answer" in caplog.text


def test_who_is_renamed_is_there_under_the_new_name_alone_and_holds_it(bus, bus_config):
    presence = bus.presence()
    with Bus.open(topics.STANDBY, bus_config) as other:
        other.of("tt3")
        session = other.session_id
        assert eventually(lambda: (presence.poll(), presence.alive())[1] == {"bridge", topics.STANDBY})
        other.rename(topics.COORDINATOR)
        assert eventually(lambda: (presence.poll(), presence.alive())[1] == {"bridge", topics.COORDINATOR})
        assert eventually(lambda: bus.sessions(topics.COORDINATOR) == {session})
        other.claim()
        health, text = HealthReporter(other), "ready"
        assert eventually(lambda: (health.poll({}, message=text), bus.of("tt3").sessions(topics.STANDBY))[1] == set())
