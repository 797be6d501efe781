"""Prompt copies, which overtake messages that are held up."""

from itertools import count
from types import SimpleNamespace

import zenoh

from tests.meeting import eventually
from touchline.bus import Bus, BusConfig, HealthReporter, prompt
from touchline.bus.prompt import Overtaken, prompt_key
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode

PUBLISHER = b"robot"


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


def test_states_and_diagnostics_have_other_queues_than_telemetry(bus_config: BusConfig) -> None:
    """In every link and router: there a message waits for those before it of the same priority."""
    heard = dict[str, zenoh.Sample]()
    with Bus.open(topics.ROBOT_SIM, bus_config) as robot, zenoh.open(bus_config.zenoh()) as listener:
        subscribers = [
            listener.declare_subscriber(key, lambda sample: heard.update({str(sample.key_expr): sample}))
            for key in ("tt2/**", prompt_key("tt2/**"))
        ]
        events, health = robot.publisher(topics.EVENTS), HealthReporter(robot)
        copies, numbers = robot.prompt_publisher(topics.STATUS, PUBLISHER), count(1)
        event, diagnostics, copy = "tt2/events", "tt2/diagnostics", prompt_key("tt2/traversal/status")

        def all_heard() -> bool:
            events.send(m.Event())
            health.poll({}, at_once=True)
            copies.send(encode(m.TraversalStatus()), next(numbers))
            return {event, diagnostics, copy} <= heard.keys()

        assert eventually(all_heard)
        del subscribers
    priorities = [heard[key].priority for key in (event, diagnostics, copy)]
    assert priorities == [zenoh.Priority.DATA, zenoh.Priority.DATA_HIGH, zenoh.Priority.REAL_TIME]
    control = [heard[key].congestion_control for key in (event, copy)]
    assert control == [zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP]
    assert heard[copy].express
