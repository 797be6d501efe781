"""Telemetry through a process of its own: nobody who does not listen holds up the robot."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from tests.robot_sim.bus_rig import PLAN
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import Event, GetPaintRequest, PaintMarks, String, TraversalStatus
from touchline.services.robot_sim import outbox as module
from touchline.services.robot_sim.outbox import Outbox, RobotOutlet

pytestmark = pytest.mark.xdist_group("outbox")  # by one worker, so that what tests share is started once

DEAF = """
import time, zenoh
from zenoh import handlers
from touchline.schemas import topics
from touchline.bus import BusConfig
config = BusConfig.from_environment()
session = zenoh.open(config.zenoh())
deaf = session.declare_subscriber(f"{config.namespace}/{topics.EVENTS.name}", handlers.FifoChannel(1))
time.sleep(0.5)  # whoever publishes knows of it
token = session.liveliness().declare_token(f"@touchline/{config.namespace}/deaf/{session.zid()}")
time.sleep(600.0)
"""
LARGE = encode(String(data="x" * 100_000))


def setup(text):
    return topics.SETUP, encode(String(data=text))


def event(number, size=0):
    return topics.EVENTS, encode(Event(text=f"{number}" + "." * size))


@pytest.fixture(scope="module")
def outbox_config():
    return BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")


@pytest.fixture(scope="module")
def outbox(outbox_config):
    """One for several tests: none of them leaves anything behind but a sender that is well."""
    made = Outbox(outbox_config)
    yield made
    made.close()


@pytest.fixture
def observer(outbox_config, outbox):
    with Bus.open(topics.OPERATOR, outbox_config) as bus:
        assert not bus.wait_for({topics.TELEMETRY}, 60.0)
        yield bus


def heard(outbox, inbox, enough, timeout_s=60.0):
    """Texts of events, until there are enough of them."""
    texts, deadline = [], time.monotonic() + timeout_s
    while not enough(texts):
        assert time.monotonic() < deadline, f"heard only {len(texts)}"
        outbox.turn()
        texts += [message.text.rstrip(".") for _, message in inbox.messages()]
        time.sleep(0.002)
    return texts


def meet(outbox, inbox):
    """Send until the first event arrives: then the sender knows of the inbox. Nothing is on the way afterwards."""
    deadline = time.monotonic() + 60.0
    while not inbox.drain():
        assert time.monotonic() < deadline, "they do not meet"
        outbox.send([event("meet")])
        outbox.turn()
        time.sleep(0.05)
    outbox.send([event("met")])
    heard(outbox, inbox, lambda texts: "met" in texts)


def test_a_frozen_sender_holds_up_nobody_and_loses_nothing(outbox, observer):
    inbox = observer.inbox([topics.EVENTS])
    meet(outbox, inbox)
    dropped = outbox.dropped
    os.kill(outbox.pid, signal.SIGSTOP)
    for number in range(60):  # more than the pipe takes; a put that blocks would never come back
        outbox.send([event(number, 100_000)])
    assert outbox.behind
    os.kill(outbox.pid, signal.SIGCONT)
    texts = heard(outbox, inbox, lambda texts: len(texts) == 60)
    assert texts == [str(number) for number in range(60)]
    assert inbox.lost == outbox.dropped - dropped == 0


def states(inbox):
    return [message.state for _, message in inbox.messages()]


def test_a_change_of_state_overtakes_telemetry_that_is_held_up(outbox, observer, outbox_config, monkeypatch):
    """And whoever takes every message, as a recorder, has them in order."""
    monkeypatch.setattr("touchline.bus.prompt._FORGOTTEN_S", 1000.0)
    running, stopped = TraversalStatus.RUNNING, TraversalStatus.ESTOPPED
    latest, every = observer.inbox([topics.STATUS], keep="recent"), observer.inbox([topics.STATUS])
    with Bus.open(topics.ROBOT_SIM, outbox_config) as bus:
        outlet = RobotOutlet(outbox, bus)
        meet(outbox, observer.inbox([topics.EVENTS]))
        os.kill(outbox.pid, signal.SIGSTOP)
        sent, heard_first, deadline = 0, [], time.monotonic() + 60.0
        while not heard_first or heard_first[-1] != stopped:
            assert time.monotonic() < deadline, "it is held up, too"
            for state in (running, stopped):
                outlet.send([(topics.STATUS, encode(TraversalStatus(state=state)))])
            sent += 2
            time.sleep(0.01)
            heard_first += states(latest)
        assert not every.drain()
        os.kill(outbox.pid, signal.SIGCONT)
        heard_in_order = []
        while len(heard_in_order) < sent:
            assert time.monotonic() < deadline, f"only {heard_in_order}"
            outlet.turn()
            heard_in_order += states(every)
        assert heard_in_order == [running, stopped] * (sent // 2)
        assert states(latest) == []
        outlet.send([(topics.STATUS, encode(TraversalStatus(state=stopped)))])
        while not (heard := states(latest)):
            assert time.monotonic() < deadline, "no further status"
            outlet.turn()
        assert heard == [stopped]
    assert every.lost == latest.lost == 0


def test_what_there_is_no_room_for_is_counted_and_shows_as_a_gap(outbox, observer, monkeypatch):
    monkeypatch.setattr(module, "MOST_BYTES", 3_000_000)
    inbox = observer.inbox([topics.EVENTS])
    meet(outbox, inbox)
    os.kill(outbox.pid, signal.SIGSTOP)
    dropped = sum(outbox.send([event(number, 100_000)]) for number in range(100))
    assert dropped > 10
    os.kill(outbox.pid, signal.SIGCONT)
    heard(outbox, inbox, lambda texts: len(texts) == 100 - dropped)
    outbox.send([event("last")])
    assert heard(outbox, inbox, bool) == ["last"]
    assert inbox.lost == dropped


def test_a_killed_sender_is_replaced_and_tells_the_latched_messages_again(outbox, observer):
    outbox.send([setup("the robot")])
    first, restarts = outbox.pid, outbox.restarts
    os.kill(first, signal.SIGKILL)
    deadline = time.monotonic() + 60.0
    while not outbox.turn():
        assert time.monotonic() < deadline, "it is not replaced"
        time.sleep(0.01)
    assert outbox.pid != first
    assert outbox.restarts == restarts + 1
    inbox = observer.inbox([topics.SETUP])
    while not (samples := inbox.drain()):
        assert time.monotonic() < deadline, "nothing was told again"
        outbox.turn()
        time.sleep(0.01)
    assert samples[-1].decode().data == "the robot"


def test_a_sender_that_takes_nothing_for_long_is_replaced(bus_config):
    now_s = 0.0
    outbox = Outbox(bus_config, clock=lambda: now_s)
    try:
        first = outbox.pid
        os.kill(first, signal.SIGSTOP)
        for _ in range(30):
            outbox.send([(topics.SETUP, LARGE)])
        assert not outbox.turn()
        now_s = module.STUCK_S + 1.0
        assert outbox.turn()
        assert outbox.pid != first
    finally:
        now_s += 1e3
        os.kill(outbox.pid, signal.SIGKILL)
        outbox.close()


@contextmanager
def deaf_subscriber(bus_config):
    """A process that subscribes to events and takes none."""
    deaf = subprocess.Popen([sys.executable, "-c", DEAF], env={**os.environ, **bus_config.environment()})
    try:
        yield deaf
    finally:
        deaf.kill()
        deaf.wait()


def test_a_subscriber_that_never_reads_is_cut_off_and_told_of(outbox, observer, outbox_config):
    inbox = observer.inbox([topics.EVENTS])
    told = observer.inbox([topics.SUPERVISOR_EVENTS])
    meet(outbox, inbox)
    with deaf_subscriber(outbox_config) as deaf:
        presence, deadline = observer.presence(), time.monotonic() + 60.0
        while "deaf" not in presence.alive():
            assert time.monotonic() < deadline, "it does not come"
            assert deaf.poll() is None, "it has ended"
            presence.poll()
            time.sleep(0.02)
        sent, codes = 0, []
        while not codes:
            assert time.monotonic() < deadline, "nobody was cut off"
            if not outbox.behind:
                outbox.send([event(f"n{sent}", 100_000)])
                sent += 1
            outbox.turn()
            inbox.drain()
            codes = [message.code for _, message in told.messages()]
        assert codes == ["subscriber-cut-off"]
    outbox.send([event("after")])
    assert "after" in heard(outbox, inbox, lambda texts: "after" in texts)
    assert inbox.lost == 0


def test_paint_is_told_by_the_process_that_has_published_it(outbox, observer):
    def marks(first_index, xs):
        return topics.PAINT, encode(
            PaintMarks(segment_id="line", first_index=first_index, width_m=0.1, x_m=xs, y_m=[0.0] * len(xs))
        )

    plan = topics.PLAN, encode(PLAN)
    outbox.send([plan, marks(7, [9.0, 9.1])])
    outbox.send([plan, marks(0, [0.0, 0.1, 0.2]), marks(2, [0.2, 0.3]), marks(5, [1.0, 1.1])])
    strokes = observer.call(topics.GET_PAINT, GetPaintRequest(), 60.0).strokes
    assert [(s.first_index, s.x_m.tolist()) for s in strokes] == [(0, [0.0, 0.1, 0.2, 0.3]), (5, [1.0, 1.1])]


def test_what_was_sent_before_a_process_died_is_still_published(bus_config):
    with Bus.open(topics.OPERATOR, bus_config) as observer:
        inbox = observer.inbox([topics.EVENTS])
        outbox = Outbox(bus_config)
        meet(outbox, inbox)
        outbox.send([event(number) for number in range(1000)])
        outbox.close()  # as its end of the pipe is when the robot's process is killed
        assert len([decode(Event, sample.payload) for sample in inbox.drain()]) == 1000
