"""Prompt copies, which overtake messages that are held up."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from types import SimpleNamespace

from tests.meeting import eventually
from touchline.bus import Bus, BusConfig, HealthReporter, prompt
from touchline.bus.prompt import Overtaken
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode

PUBLISHER = b"robot"
PATIENCE_S = 1000.0
#: Who takes nothing holds up the others for as long as the test lasts.
ROUTER = f"""
import time
from touchline.bus import BusConfig, common_settings
common_settings.PATIENCE_S, common_settings._LEASE_MS = {PATIENCE_S}, round(1000 * {PATIENCE_S})
from touchline.bus.router import open_router
with open_router(BusConfig.from_environment(), alone=True):
    print("ready", flush=True)
    time.sleep({PATIENCE_S})
"""
DEAF = f"""
import time
from touchline.bus import Bus, common_settings
from touchline.schemas import topics
common_settings._LEASE_MS = round(1000 * {PATIENCE_S})
with Bus.open(topics.BRIDGE) as bus:
    inbox = bus.inbox([topics.EVENTS, topics.DIAGNOSTICS, topics.STATUS])
    print("ready", flush=True)
    time.sleep({PATIENCE_S})
"""
TELEMETRY = f"""
from touchline.bus import Bus
from touchline.schemas import messages, topics
with Bus.open(topics.TELEMETRY, patience_s={PATIENCE_S}) as bus:
    events, event = bus.publisher(topics.EVENTS), messages.Event(text="x" * 200_000)
    print("ready", flush=True)
    while True:
        events.send(event)
"""


@contextmanager
def running(code: str, config: BusConfig) -> Iterator[subprocess.Popen[str]]:
    environment = {**os.environ, **config.environment()}
    with subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


def test_a_copy_keeps_older_messages_back_only_for_a_while(monkeypatch):
    """A stranger may have forged it, far ahead of the publisher."""
    now_s = 100.0
    monkeypatch.setattr(prompt, "time", SimpleNamespace(monotonic=lambda: now_s))
    overtaken = Overtaken()
    overtaken.note(PUBLISHER, 7)
    assert [overtaken.holds(PUBLISHER, number) for number in (6, 7, 8)] == [True, True, False]
    assert not overtaken.holds(b"another", 6)
    now_s += 1.01 * prompt._FORGOTTEN_S
    assert not overtaken.holds(PUBLISHER, 6)


def test_a_state_passes_a_router_that_is_held_up_with_telemetry(bus_config: BusConfig, tmp_path: Path) -> None:
    """Neither by the frozen client's full queue, nor by diagnostics that would wait there on the robot's own link.

    In one of ten routers the threads that receive wait for each other all the same, as Zenoh's runtime hands out work.
    """
    (client := tmp_path / "client.json5").write_text('{mode: "client"}')
    config = BusConfig(bus_config.endpoint, config_file=client)
    assert any(_passes_held_up_router(bus_config, config) for _ in range(3))


def _passes_held_up_router(router: BusConfig, config: BusConfig) -> bool:
    with (
        running(ROUTER, router),
        running(DEAF, config) as deaf,
        Bus.open(topics.OPERATOR, config) as operator,
        Bus.open(topics.ROBOT_SIM, config) as robot,
    ):
        status, health = operator.inbox([topics.STATUS], keep="recent"), HealthReporter(robot)
        copies, heard, numbers = robot.prompt_publisher(topics.STATUS, PUBLISHER), list[int](), count(1)

        def hears(state: int) -> bool:
            copies.send(encode(m.TraversalStatus(state=state)), next(numbers))
            heard.extend(message.state for _, message in status.messages() if isinstance(message, m.TraversalStatus))
            return state in heard

        assert eventually(lambda: hears(m.TraversalStatus.RUNNING))
        telemetry = operator.inbox([topics.EVENTS], keep="latest")
        deaf.send_signal(signal.SIGSTOP)
        with running(TELEMETRY, config):
            assert eventually(lambda: bool(telemetry.drain()))
            while telemetry.wait(1.0):
                pass  # until it is held up
            for _ in range(3):
                health.poll({}, at_once=True)
            return eventually(lambda: hears(m.TraversalStatus.ESTOPPED), 10.0)
