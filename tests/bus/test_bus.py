"""The bus over real Zenoh sessions on loopback."""

import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from datetime import datetime
from types import SimpleNamespace

import pytest
import zenoh

from tests.meeting import caught_up, eventually
from touchline.bus import Bus, BusConfig, CallError, HealthReporter, attachment, calls
from touchline.bus.counters import LARGEST_GAP, MOST_PUBLISHERS, SequenceGaps
from touchline.bus.inbox import MOST_WAITING
from touchline.schemas import topics
from touchline.schemas.cdr import MAX_PAYLOAD_BYTES, encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Clock, CommandRequest, CommandResponse, Event, Imu, String, Time, Vector3
from touchline.schemas.user_folders import keys_folder
from touchline.security.identity import IDENTITIES


@pytest.fixture
def pair(bus_config: BusConfig) -> Iterator[tuple[Bus, Bus]]:
    with Bus.open("robot-sim", bus_config) as robot, Bus.open("bridge", bus_config) as bridge:
        assert not robot.wait_for({"bridge"}, 60.0)
        assert not bridge.wait_for({"robot-sim"}, 60.0)
        yield robot, bridge


@pytest.fixture
def outsider(bus_config: BusConfig) -> Iterator[zenoh.Session]:
    """A peer that does not speak our language."""
    with zenoh.open(bus_config.zenoh()) as session:
        yield session


def test_a_burst_arrives_whole_and_in_order(pair):
    robot, bridge = pair
    inbox, publisher = bridge.inbox([topics.CLOCK]), robot.publisher(topics.CLOCK)
    caught_up(robot, bridge)
    count = MOST_WAITING + 5000  # the publisher has to wait for the reader
    payload = encode(Clock(clock=Time(sec=1)))

    def burst() -> None:
        for _ in range(count):
            publisher.send_bytes(payload)

    sender = threading.Thread(target=burst)
    sender.start()
    samples = []
    assert eventually(lambda: samples.extend(inbox.drain()) or len(samples) >= count)
    sender.join()
    assert [sample.sequence for sample in samples] == list(range(1, count + 1))
    assert bridge.counters.lost == inbox.lost == 0


def test_latest_inbox_keeps_only_the_newest(pair):
    robot, bridge = pair
    inbox, publisher = bridge.inbox([topics.CLOCK], keep="latest"), robot.publisher(topics.CLOCK)
    caught_up(robot, bridge)
    for second in range(100):
        publisher.send(Clock(clock=Time(sec=second)))
    caught_up(bridge, robot)
    assert [sample.decode() for sample in inbox.drain()] == [Clock(clock=Time(sec=99))]
    assert bridge.counters.lost == 0


def test_latched_topic_reaches_late_joiners(pair):
    robot, bridge = pair
    publisher = robot.publisher(topics.TEMPLATE)
    publisher.send(String(data="old"))
    publisher.send(String(data="new"))
    inbox = bridge.inbox([topics.TEMPLATE])
    assert [sample.decode() for sample in inbox.wait(60.0)] == [String(data="new")]


def test_any_order_of_starting_works(bus_config):
    with Bus.open("bridge", bus_config) as early:
        inbox = early.inbox([topics.TEMPLATE])
        with Bus.open("robot-sim", bus_config) as late:
            late.publisher(topics.TEMPLATE).send(String(data="x"))
            assert [sample.decode() for sample in inbox.wait(60.0)] == [String(data="x")]


def test_sequence_gaps_are_counted_per_publisher():
    gaps = SequenceGaps()
    assert [gaps.missed(b"a", n) for n in (7, 8, 11)] == [0, 0, 2]
    assert gaps.missed(b"b", 3) == 0
    assert gaps.missed(b"a", 12) == 0
    assert gaps.missed(b"a", 12) == -1


LARGEST = 2**63 - 1


@pytest.mark.parametrize("forged", [LARGEST, 5_000_000, 1000, 106, 1])
def test_a_number_forged_in_anothers_name_costs_one_message_at_most(forged):
    gaps = SequenceGaps()
    assert [gaps.missed(b"robot", n) for n in range(1, 106)] == [0] * 105
    assert gaps.missed(b"robot", forged) <= LARGEST_GAP
    counted = [gaps.missed(b"robot", n) for n in range(106, 120)]
    assert counted[2:] == [0] * 12
    assert counted[:2] in ([0, 0], [-1, 0])


def test_a_late_joiners_copy_of_an_old_message_is_a_repeat():
    gaps = SequenceGaps()
    assert [gaps.missed(b"a", n) for n in (50, 51, 30, 52, 53)] == [0, 0, -1, 0, 0]


def test_thousands_of_publishers_are_not_remembered():
    gaps = SequenceGaps()
    for number in range(20_000):
        assert gaps.missed(b"%16d" % number, LARGEST - number) == 0
        assert gaps.missed(b"robot", number) == 0
    assert len(gaps) == MOST_PUBLISHERS


def test_an_inbox_that_skims_looks_into_one_sample_of_each_publisher_and_counts_all(pair):
    robot, bridge = pair
    inbox = bridge.inbox([topics.CLOCK])
    inbox.skim(3600.0)
    first, second = robot.publisher(topics.CLOCK), robot.publisher(topics.CLOCK)
    caught_up(robot, bridge)
    samples = []

    def arrived(count: int) -> bool:
        samples.extend(inbox.drain())
        return len(samples) >= count

    for publisher in (first, second, first, first):
        publisher.send(Clock(clock=Time(sec=7)))
    assert eventually(lambda: arrived(4))
    looked_into = [sample for sample in samples if sample.payload]
    assert [sample.publisher for sample in looked_into] == [first.id, second.id]
    assert [sample.decode() for sample in looked_into] == [Clock(clock=Time(sec=7))] * 2
    assert [sample.sequence for sample in samples if sample.publisher == first.id] == [1, 2, 3]
    inbox.skim(0.0)
    first.send(Clock(clock=Time(sec=8)))
    assert eventually(lambda: arrived(5))
    assert samples[-1].payload
    assert inbox.lost == 0


@pytest.fixture
def starter(pair):
    """A robot that counts how often it is started."""
    robot, bridge = pair
    server, count, done = robot.serve(topics.START), [0], threading.Event()
    caught_up(bridge, robot)

    def serve() -> None:
        while not done.is_set():
            if (call := server.wait(0.05)) is not None:
                count[0] += 1
                time.sleep(0.05)
                call.reply(CommandResponse(success=True, message=f"start {count[0]}"))

    thread = threading.Thread(target=serve)
    thread.start()
    yield bridge, count
    done.set()
    thread.join()


def test_the_next_request_is_looked_for_more_closely_than_the_first(pair, monkeypatch):
    robot, bridge = pair
    server = robot.serve(topics.START)

    def pauses_s() -> list[float]:
        """The first hundred between two looks."""
        found: list[float] = []

        def sleep(pause_s: float) -> None:
            found.append(pause_s)
            if len(found) == 100:
                raise InterruptedError

        with monkeypatch.context() as patch, pytest.raises(InterruptedError):
            patch.setattr(calls, "time", SimpleNamespace(sleep=sleep, monotonic=time.monotonic))
            server.wait(60.0)
        return found

    idle_s = pauses_s()
    assert idle_s == pauses_s() == idle_s[:1] * 100
    request = CommandRequest(request_id="once")
    caller = threading.Thread(target=lambda: bridge.call(topics.START, request, 60.0))
    caller.start()
    server.wait(60.0).reply(CommandResponse(success=True))
    caller.join()
    after_s = pauses_s()
    assert after_s[0] < 0.1 * idle_s[0]
    assert after_s == sorted(after_s)
    assert after_s[-1] == idle_s[0]
    assert pauses_s() == idle_s


def test_a_repeated_request_does_nothing_more(starter):
    bridge, count = starter
    answers = [bridge.call(topics.START, CommandRequest(request_id="once")) for _ in range(3)]
    assert count == [1]
    assert {answer.message for answer in answers} == {"start 1"}
    assert bridge.call(topics.START, CommandRequest(request_id="twice")).message == "start 2"


def test_the_same_request_at_the_same_time_is_one(starter):
    bridge, count = starter
    answers: list[CommandResponse] = []
    request = CommandRequest(request_id="both")
    callers = [threading.Thread(target=lambda: answers.append(bridge.call(topics.START, request))) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert count == [1]
    assert len(answers) == 4


BAD_REQUESTS = (
    (None, "does not begin with a CDR header"),
    (b"", "does not begin with a CDR header"),
    (b"junk", "does not begin with a CDR header"),
    (b"\x00\x01\x00\x00\xff\xff\xff\x7f", "not a CDR message"),
    (b"\x00\x01\x00\x00" + bytes(30_000_000), f"at most {topics.START.most_bytes:,}"),
)


def test_bad_requests_get_a_reason_and_good_ones_still_an_answer(starter, outsider):
    bridge, count = starter
    for payload, says in BAD_REQUESTS:
        replies = []

        def ask(payload=payload, replies=replies) -> bool:
            replies.extend(outsider.get(bridge.key(topics.START.name), payload=payload, timeout=30.0))
            return bool(replies)

        assert eventually(ask)
        assert says in replies[0].err.payload.to_string()
    assert count == [0]
    assert bridge.call(topics.START, CommandRequest(request_id="after")).success


def test_nobody_answers(pair):
    with pytest.raises(CallError, match="nobody answers"):
        pair[1].call(topics.PAUSE, CommandRequest())


def test_who_has_identities_and_meets_nobody_on_an_open_bus_is_reminded_of_them(bus_config, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    (keys_folder() / IDENTITIES).mkdir(parents=True)
    with Bus.open(topics.OPERATOR, bus_config) as bus, pytest.raises(CallError, match="a secured one takes --identity"):
        bus.call(topics.PAUSE, CommandRequest())


@pytest.mark.parametrize("timeout_s", [0.3, 2.0])
def test_no_answer_in_time(pair, timeout_s):
    robot, bridge = pair
    server = robot.serve(topics.PAUSE)
    caught_up(bridge, robot)
    with pytest.raises(CallError, match=f"no answer within {timeout_s} s"):
        bridge.call(topics.PAUSE, CommandRequest(), timeout_s)
    caught_up(robot, bridge)
    assert server.poll() is not None


def test_junk_on_a_topic_is_counted_and_dropped(pair, outsider):
    robot, bridge = pair
    inbox, publisher = bridge.inbox([topics.EVENTS]), robot.publisher(topics.EVENTS)
    caught_up(robot, bridge)
    foreign = encode(Event(text="from a foreign publisher"))

    def heard() -> bool:
        outsider.put(bridge.key(topics.EVENTS.name), foreign)
        return bool(inbox.wait(0.05))

    assert eventually(heard)
    noise = random.Random(1).randbytes
    for junk in (b"", b"junk", noise(500), b"\x00\x01\x00\x00" + noise(40), bytes(MAX_PAYLOAD_BYTES + 1)):
        outsider.put(bridge.key(topics.EVENTS.name), junk, congestion_control=zenoh.CongestionControl.BLOCK)
    assert eventually(lambda: not inbox.drain() and bridge.counters.rejected == 5)
    outsider.put(bridge.key(topics.EVENTS.name), foreign)
    assert [sample.decode().text for sample in inbox.wait(60.0)] == ["from a foreign publisher"]
    publisher.send(Event(text="still here"))
    assert [sample.decode().text for sample in inbox.wait(60.0)] == ["still here"]
    assert bridge.counters.lost == 0


def test_what_a_cut_off_damaged_is_dropped_and_counted_as_lost(pair, outsider):
    """Its end is another message's, as Zenoh leaves it: most would pass for numbers that were measured."""
    robot, bridge = pair
    inbox, publisher = bridge.inbox([topics.IMU, topics.CLOCK]), robot.publisher(topics.IMU)
    caught_up(robot, bridge)
    key, clock_key = robot.key(topics.IMU.name), robot.key(topics.CLOCK.name)
    honest = [encode(Imu(angular_velocity=Vector3(z=number))) for number in range(4)]
    samples = []

    def put(where: str, sequence: int, payload: bytes, sealed: bytes) -> None:
        numbered = attachment.pack(sequence, time.time_ns(), publisher.id)
        outsider.put(where, payload, attachment=attachment.seal(numbered, attachment.checksum_of_key(key), sealed))

    assert eventually(lambda: publisher.send_bytes(honest[0]) or samples.extend(inbox.drain()) or samples)
    put(key, publisher.sequence + 1, honest[1][:-150] + honest[2][:150], honest[1])
    put(clock_key, publisher.sequence + 1, encode(Clock()), encode(Clock()))  # under another key than it was sent
    assert eventually(lambda: samples.extend(inbox.drain()) or inbox.rejected == {"imu/data_raw": 1, "clock": 1})
    publisher.sequence += 1
    publisher.send_bytes(honest[3])
    assert eventually(lambda: samples.extend(inbox.drain()) or samples[-1].payload == honest[3])
    assert {sample.payload for sample in samples} == {honest[0], honest[3]}
    assert samples[-1].missed == inbox.lost == 1
    assert "damaged on the way" in bridge.counters.last_rejection


def test_a_killed_process_is_missed_at_once(bus_config):
    code = "import time\nfrom touchline.bus import Bus\nwith Bus.open('planner'): time.sleep(60)"
    environment = {**os.environ, **bus_config.environment()}
    with Bus.open("operator", bus_config) as bus, subprocess.Popen([sys.executable, "-c", code], env=environment) as it:
        presence = bus.presence()
        assert eventually(lambda: bool(presence.poll()) and "planner" in presence.alive())
        it.send_signal(signal.SIGKILL)
        assert eventually(
            lambda: any(change.node == "planner" and not change.alive for change in presence.poll()), 10.0
        )
        assert presence.alive() == {"operator"}


def test_the_meeting_point_may_die(bus_config):
    """The first process listens on the endpoint; later ones must find each other when it is gone."""
    code = "from touchline.bus import Bus\nwith Bus.open('hub'): print('listening', flush=True); input()"
    environment = {**os.environ, **bus_config.environment()}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], env=environment, **pipes) as hub:
        assert hub.stdout.readline() == b"listening\n"
        with Bus.open("bridge", bus_config) as early:
            assert not early.wait_for({"hub"}, 60.0)
            hub.kill()
            hub.wait()
            with Bus.open("planner", bus_config) as late:
                assert not early.wait_for({"planner"}, 60.0)
                assert not late.wait_for({"bridge"}, 60.0)


def test_diagnostics_have_the_time_of_the_bus_and_wall_time_as_a_value(pair):
    robot, bridge = pair
    inbox, reporter, clock = bridge.inbox([topics.DIAGNOSTICS]), HealthReporter(robot), bridge.publisher(topics.CLOCK)
    found = []

    def reported() -> bool:
        clock.send(Clock(clock=Time(sec=12, nanosec=5)))  # until the other one listens
        reporter.poll({"answer": 42}, at_once=True)
        found[:] = [message for _, message in inbox.messages() if message.header.stamp.sec] or found
        return bool(found)

    assert eventually(reported)
    assert found[-1].header.stamp == Time(sec=12, nanosec=5)
    (status,) = found[-1].status
    values = {entry.key: entry.value for entry in status.values}
    assert (status.name, values["answer"], int(values["pid"])) == ("robot-sim", "42", os.getpid())
    assert abs(datetime.fromisoformat(values["wall_time"]).timestamp() - time.time()) < 600


def test_configuration_file(tmp_path, bus_config):
    path = tmp_path / "zenoh.json5"
    path.write_text(
        f'{{mode: "peer", listen: {{endpoints: ["{bus_config.endpoint}"]}}, '
        "scouting: {multicast: {enabled: false}}}"
    )
    with Bus.open("bridge", BusConfig(config_file=path)) as bus:
        assert bus.wait_for({"bridge"}, 60.0) == set()
    with pytest.raises(SpecError):
        BusConfig(endpoint="7461")
    path.write_text("{mode: ")
    with (
        pytest.raises(SpecError, match=r"not a Zenoh configuration \((?!.* at /)"),
        Bus.open("x", BusConfig(config_file=path)),
    ):
        pass


def test_requests_that_nobody_polls_block_nothing_else(pair):
    robot, bridge = pair
    server, inbox, publisher = robot.serve(topics.START), robot.inbox([topics.CLOCK]), bridge.publisher(topics.CLOCK)
    caught_up(bridge, robot)
    questions = [bridge.ask(topics.START, encode(CommandRequest(request_id=str(i))), 60.0) for i in range(500)]
    publisher.send(Clock())  # behind them all
    assert eventually(inbox.drain)
    assert server.poll() is not None
    assert eventually(lambda: questions[0].poll() is not None)  # told that it was not heard


@pytest.mark.parametrize(("before", "behind"), [(0, 800), (100, 0)])
def test_a_stop_among_a_flood_of_repeats_is_found_in_one_poll(pair, before, behind):
    robot, bridge = pair
    server, inbox, publisher = robot.serve(topics.ESTOP), robot.inbox([topics.CLOCK]), bridge.publisher(topics.CLOCK)
    caught_up(bridge, robot)

    def stops(request_id, count=1):
        request = encode(CommandRequest(request_id=request_id))
        return [bridge.ask(topics.ESTOP, request, 60.0) for _ in range(count)]

    questions = stops("repeated")
    assert eventually(lambda: (call := server.poll()) is not None and (call.reply(CommandResponse()) or True))
    questions += stops("repeated", before) + stops("new") + stops("repeated", behind)
    publisher.send(Clock())
    assert eventually(inbox.drain)  # it came behind them all
    call = server.poll()
    assert call is not None
    assert call.request_id == "new"


def test_an_answer_is_remembered_through_many_others(pair):
    robot, bridge = pair
    server, done = robot.serve(topics.START), []

    def serve():
        while (call := server.poll()) is not None:
            done.append(call.request.request_id)
            call.reply(CommandResponse(success=True))

    def order(request_id):
        return bridge.call(topics.START, CommandRequest(request_id=request_id), 60.0, serve)

    order("first")
    for number in range(200):
        order(str(number))
    order("first")
    assert done.count("first") == 1
