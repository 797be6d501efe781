"""Obstacles to the robot's work stay in view until they are gone, and the next step says what to do."""

import pytest

from tests.tui import scenes
from tests.tui.console import console, plain, reduced
from tests.tui.scenes import received
from touchline.onboard.executive import hazards
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import alerts, panels
from touchline.tui.key_bar import KeyBar
from touchline.tui.protocol import Incoming
from touchline.tui.reduction import apply_event
from touchline.tui.signal_bar import SignalBar
from touchline.tui.state import ConsoleState

EMPTY = received(topics.SPRAYER, m.SprayerState(tank_l=0.02))
FULL = received(topics.SPRAYER, m.SprayerState(tank_l=20.0))
FLOAT = received(topics.GNSS_STATUS, m.GnssStatus(fix=m.GnssStatus.FLOAT))
CHARGED = received(topics.BATTERY, m.BatteryState(percentage=1.0))
FLAT = received(topics.BATTERY, m.BatteryState(percentage=0.07))


def told(template: Template, state: int, reason: str = "") -> Incoming:
    return received(topics.STATUS, scenes.status(template, state, 14, 0.5, reason=reason))


def texts(state: ConsoleState) -> list[str]:
    return [alert.text for alert in alerts.alerts(state)]


def test_the_limits_are_the_robots() -> None:
    assert (alerts.EMPTY_TANK_L, alerts.FLAT_BATTERY) == (hazards.LOW_TANK_L, hazards.LOW_BATTERY)


def test_an_alert_lasts_until_its_cause_is_gone(template: Template) -> None:
    state = reduced([*scenes.mid_run(template), EMPTY, FLOAT, FLAT])
    assert texts(state) == ["TANK EMPTY", "BATTERY 7 %", "NO FIX (float)"]
    for other in (m.TraversalStatus.ESTOPPED, m.TraversalStatus.PAUSED, m.TraversalStatus.RUNNING):
        apply_event(state, told(template, other), 0.0)
        assert "TANK EMPTY" in texts(state)
    for event in (FULL, *scenes.robot_health()):
        apply_event(state, event, 0.0)
    assert texts(state) == []


@pytest.mark.parametrize(
    ("cause", "key", "step"),
    [
        (EMPTY, "u", "refill the tank, then resume (g)"),
        (FLAT, "b", "replace the battery, then resume (g)"),
        (FLOAT, "", "wait for the RTK fix, then resume (g)"),
        (FULL, "g", "resume"),
    ],
)
def test_the_next_step_ends_the_cause(template: Template, cause: Incoming, key: str, step: str) -> None:
    state = reduced([*scenes.mid_run(template), cause, told(template, m.TraversalStatus.PAUSED, "so")])
    assert panels.hint(state) == (key, step)


def test_the_first_reason_survives_an_emergency_stop_and_a_reset(template: Template) -> None:
    state = reduced([*scenes.mid_run(template), EMPTY, told(template, m.TraversalStatus.PAUSED, "the tank is empty")])
    apply_event(state, told(template, m.TraversalStatus.ESTOPPED, "emergency stop"), 0.0)
    apply_event(state, told(template, m.TraversalStatus.PAUSED, "emergency stop released; resume to go on"), 0.0)
    assert "stopped first: the tank is empty" in "\n".join(line.plain for line in panels.status_lines(state, 60))
    apply_event(state, told(template, m.TraversalStatus.RUNNING), 0.0)
    assert state.robot.stopped_by == ""


async def test_alerts_and_orders_share_the_row_below_the_header(template: Template) -> None:
    paused = told(template, m.TraversalStatus.PAUSED, "the tank is empty")
    async with console(*scenes.mid_run(template), EMPTY, paused, size=(80, 24)) as (app, _link, pilot):
        app.state.orders.stop.press("a", "robot-1")
        app.state.orders.stop.tried("a", 12)
        app.tick()
        await pilot.pause()
        shown = plain(app, SignalBar)
        assert "E-STOP NOT ACKNOWLEDGED – repeating (12)" in shown
        assert "▲ TANK EMPTY" in shown
        assert "u Refill" in plain(app, KeyBar)
        assert app.query_one(SignalBar).region.y == 1


def test_what_comes_from_outside_cannot_command_the_terminal(template: Template) -> None:
    bell = "\x1b]52;c;aGk=\x07\x1b[2Jred\x9b31m"
    state = reduced(
        [
            *scenes.mid_run(template),
            told(template, m.TraversalStatus.PAUSED, bell),
            scenes.event(1.0, m.Event.WARN, bell, bell),
            received(topics.DIAGNOSTICS, scenes.diagnostics(topics.BRIDGE, bell, recording=bell)),
            received(topics.DIAGNOSTICS, scenes.diagnostics(bell, bell)),
            received(topics.SUPERVISOR_EVENTS, m.Event(text=bell, source=bell)),
        ]
    )
    segments = tuple(segment.model_copy(update={"label": bell}) for segment in template.segments)
    hostile = template.model_copy(update={"name": bell, "title": bell, "segments": segments})
    state.choose_template(hostile, "{}")
    shown = [line.plain for width in (33, 80) for line in panels.status_lines(state, width)]
    shown += [line.plain for line in panels.service_lines(state, 60)]
    shown += [entry.source + entry.text for entry in state.log.entries]
    shown += [row.label for row in state.draft.template.rows] if state.draft.template else []
    assert not [text for text in shown if any(char in text for char in "\x1b\x07\x9b")]
    assert any("red" in text for text in shown)


@pytest.mark.parametrize(
    ("reason", "low", "filled"),
    [
        ("the tank is empty", EMPTY, FULL),
        ("the tank is all but empty", EMPTY, FULL),
        ("the battery is low (7 %)", FLAT, CHARGED),
    ],
)
def test_the_reason_goes_with_a_refill(template: Template, reason: str, low: Incoming, filled: Incoming) -> None:
    state = reduced([*scenes.mid_run(template), low, told(template, m.TraversalStatus.PAUSED, reason)])
    assert reason in [line.plain for line in panels.status_lines(state, 46)]
    apply_event(state, filled, 0.0)
    assert not [line.plain for line in panels.status_lines(state, 46) if reason[:8] in line.plain]
    assert panels.hint(state) == ("g", "resume")
    apply_event(state, told(template, m.TraversalStatus.PAUSED, "paused by the operator"), 0.0)
    assert "stopped first" not in " ".join(line.plain for line in panels.status_lines(state, 46))


@pytest.mark.parametrize(("event", "key"), [(EMPTY, "u"), (FLAT, "b"), (FLOAT, "g")])
def test_no_hint_is_cut_where_a_key_stands(template: Template, event: Incoming, key: str) -> None:
    state = reduced([*scenes.mid_run(template), event, told(template, m.TraversalStatus.PAUSED)])
    for width in (24, 30, 31, 44, 50):
        lines = [line.plain for line in panels.status_lines(state, width)]
        shown = " ".join(" ".join(lines).split())
        assert "then resume (g)" in shown and (key == "g" or f" {key} " in lines[1] + lines[2])
        head = lines[: next(index for index, line in enumerate(lines) if "(g)" in line) + 1]
        assert max(map(len, head)) <= width
