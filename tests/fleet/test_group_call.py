"""A coordinator's call to many robots at once: those that refuse or are silent are named, and hold up nobody."""

import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from tests.meeting import caught_up
from touchline.bus import Bus, BusConfig
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.services.coordinator import group_call
from touchline.services.coordinator.group_call import GroupCall, reasons, start_guidance
from touchline.services.coordinator.invitations import MOST_PAUSE_S, Invitations

NAMES = ("a", "b", "c", "d")


@contextmanager
def robots(config: BusConfig, serve: Callable[[tuple[Bus, ...]], Callable[[], None]]) -> Iterator[tuple[Bus, ...]]:
    """A coordinator's buses of robots that a thread plays: it turns what `serve` makes of theirs."""
    over = threading.Event()
    with Bus.open_all(topics.ROBOT_SIM, config.of(*NAMES)) as theirs:
        turn = serve(theirs)
        with Bus.open_all(topics.COORDINATOR, config.of(*NAMES)) as ours:
            for here, there in zip(ours, theirs, strict=True):
                caught_up(here, there)

            def play() -> None:
                while not over.wait(0.002):
                    turn()

            thread = threading.Thread(target=play)
            thread.start()
            try:
                yield ours
            finally:
                over.set()
                thread.join()


def pausing(theirs: tuple[Bus, ...]) -> Callable[[], None]:
    """The first pauses, the second refuses, the third says that it cannot serve, the last hears and says nothing."""
    servers = [bus.serve(topics.PAUSE) for bus in theirs]

    def turn() -> None:
        calls = [server.poll() for server in servers]
        if calls[0] is not None:
            calls[0].reply(m.CommandResponse(success=True))
        if calls[1] is not None:
            calls[1].reply(m.CommandResponse(success=False, message="cannot pause: emergency stop"))
        if calls[2] is not None:
            calls[2].fail("no room")

    return turn


def silent(theirs: tuple[Bus, ...]) -> Callable[[], None]:
    """All of them hear, and say nothing."""
    servers = [bus.serve(topics.PAUSE) for bus in theirs]

    def turn() -> None:
        for server in servers:
            server.poll()

    return turn


def ask_to_pause(buses: tuple[Bus, ...], timeout_s: float) -> GroupCall:
    named = dict(zip(NAMES, buses, strict=True))
    return GroupCall(named, topics.PAUSE, m.CommandRequest(request_id=uuid.uuid4().hex), timeout_s)


def test_who_refuses_or_is_silent_is_named_with_the_reason(bus_config: BusConfig) -> None:
    with robots(bus_config, pausing) as buses:
        refused = ask_to_pause(buses, 2.0).wait()
    assert refused == {"b": "cannot pause: emergency stop", "c": "no room", "d": "does not answer"}
    assert reasons(refused) == "b: cannot pause: emergency stop; c: no room; d: does not answer"


def test_all_robots_together_have_one_deadline(bus_config: BusConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter((100.0, 130.0, 159.9, 160.0))  # when it asks, and at each look
    with robots(bus_config, silent) as buses:
        monkeypatch.setattr(group_call, "time", SimpleNamespace(monotonic=lambda: next(clock)))
        asked = ask_to_pause(buses, 60.0)
        assert [asked.done for _ in range(3)] == [False, False, True]
    assert asked.refused == dict.fromkeys(NAMES, "does not answer")


def test_who_does_not_want_to_be_guided_says_why(bus_config: BusConfig) -> None:
    def guided(theirs: tuple[Bus, ...]) -> Callable[[], None]:
        servers = [bus.serve(topics.BEGIN_GUIDED) for bus in theirs]

        def turn() -> None:
            for bus, server in zip(theirs, servers, strict=True):
                if (call := server.poll()) is not None:
                    told = call.request.lockstep_s, call.request.plans, call.request.margin_m
                    good = bus.namespace != "c" and told == (0.4, True, 0.02)
                    call.reply(m.BeginGuidedResponse(success=good, message="guided" if good else "a job is loaded"))

        return turn

    with robots(bus_config, guided) as buses:
        refused = start_guidance(dict(zip(NAMES, buses, strict=True)), 0.4, plans=True, margin_m=0.02).wait()
    assert refused == {"c": "a job is loaded"}


def test_who_refuses_is_asked_ever_more_rarely_and_told_of_once() -> None:
    invitations, now_s, pauses_s, told = Invitations(), 100.0, [], []
    assert invitations.due(["a"], now_s) == ["a"]
    for _ in range(8):
        assert invitations.due(["a"], now_s + 1e6) == []  # it has not answered yet
        told.append(invitations.refuses("a", "cannot turn on the spot", now_s))
        asked_s = now_s
        while not invitations.due(["a"], now_s):
            now_s += 0.5
        pauses_s.append(now_s - asked_s)
    assert pauses_s == [1.0, 2.0, 4.0, 8.0, 16.0, MOST_PAUSE_S, MOST_PAUSE_S, MOST_PAUSE_S]
    assert told == [True] + [False] * 7
    assert invitations.refuses("a", "a job is loaded", now_s)


def test_who_comes_anew_is_asked_at_once_and_who_has_joined_is_not() -> None:
    invitations = Invitations()
    invitations.joins("member")
    assert invitations.due(["a", "b", "member"], 0.0) == ["a", "b"]
    invitations.joins("b")
    for now_s in (0.0, 1.0, 3.0):
        invitations.refuses("a", "not ready", now_s)
    assert invitations.due(["a", "b", "member"], 4.0) == []
    assert invitations.due(["b"], 4.5) == []
    assert invitations.due(["a", "b", "member"], 5.0) == ["a", "member"]
    assert not invitations.refuses("a", "not ready", 5.0)
    assert invitations.due(["a"], 6.0) == ["a"]
    invitations.joins("a")
    assert invitations.due(["a"], 1e9) == []
    assert invitations.refuses("a", "not ready", 7.0)
