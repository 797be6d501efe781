"""Several robots on one bus, some of them of one process: each with keys, presence and counters of its own."""

import threading
from collections.abc import Iterator

import pytest

from tests.meeting import caught_up, eventually
from touchline.bus import Bus, BusConfig, CallError
from touchline.schemas import topics
from touchline.schemas.bus_variables import NAMESPACE_VARIABLE
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import Clock, CommandRequest, CommandResponse

ROBOTS = ("r1", "club/r2", "r3")


@pytest.fixture
def hosts(bus_config: BusConfig) -> Iterator[tuple[Bus, ...]]:
    """A process of three robots."""
    with Bus.open_all(topics.ROBOT_SIM, bus_config.of(*ROBOTS)) as buses:
        yield buses


@pytest.fixture
def operators(bus_config: BusConfig, hosts: tuple[Bus, ...]) -> Iterator[tuple[Bus, ...]]:
    """A process that acts for all of them."""
    with Bus.open_all(topics.OPERATOR, bus_config.of(*ROBOTS)) as buses:
        for host, operator in zip(hosts, buses, strict=True):
            caught_up(operator, host)
        yield buses


def test_what_one_robot_says_is_heard_as_its_own_alone(hosts, operators):
    inboxes = [operator.inbox([topics.CLOCK]) for operator in operators]
    for host, operator in zip(hosts, operators, strict=True):
        caught_up(host, operator)
    before = [operator.counters.received for operator in operators]
    hosts[1].publisher(topics.CLOCK).send(Clock())
    samples = []
    assert eventually(lambda: samples.extend(inboxes[1].drain()) or samples)
    assert [sample.namespace for sample in samples] == ["club/r2"]
    assert not inboxes[0].drain()
    assert not inboxes[2].drain()
    heard = [operator.counters.received for operator in operators]
    assert [now - then for now, then in zip(heard, before, strict=True)] == [0, 1, 0]


def test_a_command_reaches_the_robot_that_it_is_for_and_no_other(hosts, operators):
    servers = [host.serve(topics.ESTOP) for host in hosts]
    heard = []

    def serve():
        for host, server in zip(hosts, servers, strict=True):
            while (call := server.poll()) is not None:
                heard.append(host.namespace)
                call.reply(CommandResponse(success=True))

    assert operators[2].call(topics.ESTOP, CommandRequest(request_id="same"), 60.0, serve).success
    assert operators[0].call(topics.ESTOP, CommandRequest(request_id="same"), 60.0, serve).success
    assert heard == ["r3", "r1"]


def test_an_answer_is_believed_from_that_robots_own_node_only(bus_config, hosts, operators):
    with Bus.open("stranger", bus_config.of("r1")) as stranger:
        server = stranger.serve(topics.ESTOP)
        caught_up(operators[0], stranger)

        def answer():
            if (call := server.poll()) is not None:
                call.reply(CommandResponse(success=True))

        with pytest.raises(CallError, match="not trusted"):
            operators[0].call(topics.ESTOP, CommandRequest(request_id="a"), 20.0, answer)


def test_the_roster_names_the_robots_and_forgets_those_that_leave(bus_config, hosts):
    with Bus.open(topics.OBSERVER, bus_config.of("elsewhere")) as observer:
        roster = observer.roster()

        def robots():
            roster.poll()
            return roster.robots({topics.ROBOT_SIM})

        assert eventually(lambda: robots() == tuple(sorted(ROBOTS)))
        with Bus.open(topics.ROBOT_SIM, bus_config.of("r9")):
            assert eventually(lambda: robots() == tuple(sorted((*ROBOTS, "r9"))))
        assert eventually(lambda: robots() == tuple(sorted(ROBOTS)))
        assert roster.robots({topics.OBSERVER}) == ("elsewhere",)


def test_who_asks_a_robot_that_is_not_there_is_told_which_are(bus_config, hosts):
    told = "no robot tt2 on the bus, but club/r2, r1, r3; name one with --robot"
    with Bus.open(topics.OPERATOR, bus_config.of("tt2")) as operator, pytest.raises(CallError, match=told):
        operator.call(topics.START, CommandRequest(request_id="a"), 30.0)


def test_every_robot_of_a_process_has_a_name_of_its_own(bus_config, hosts):
    """A second process may not be the robot that is there already."""
    service = topics.diagnostics_service(topics.ROBOT_SIM)
    servers, over = [host.serve(service) for host in hosts], threading.Event()

    def serve():
        while not over.wait(0.002):
            for server in servers:
                if (call := server.poll()) is not None:
                    call.reply(service.response())

    def claim(*robots):
        with Bus.open_all(topics.ROBOT_SIM, bus_config.of(*robots)) as buses:
            for bus in buses:
                bus.claim()

    serving = threading.Thread(target=serve)
    serving.start()
    try:
        with pytest.raises(TouchlineError, match='already running for robot "r3"'):
            claim("r4", "r3")
        claim("r4", "r5")
    finally:
        over.set()
        serving.join()


@pytest.mark.parametrize("given", ["", "r1,", "r1,r1", "r1,a b", "r1," + "x" * 65])
def test_unusable_sets_are_refused(monkeypatch, given):
    monkeypatch.setenv(NAMESPACE_VARIABLE, given)
    with pytest.raises(SpecError, match=NAMESPACE_VARIABLE):
        BusConfig.from_environment()


def test_robots_travel_by_environment_and_an_option_goes_before_it(monkeypatch, bus_config):
    config = bus_config.of(*ROBOTS)
    for name, value in config.environment().items():
        monkeypatch.setenv(name, value)
    assert BusConfig.from_environment() == config
    assert BusConfig.from_environment(["r7"]).namespace == "r7"
    with pytest.raises(SpecError, match=r"names 3 robots \(r1, club/r2, r3\); name one"):
        assert config.namespace
