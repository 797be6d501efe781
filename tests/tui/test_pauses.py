"""A pause as the console shows it: whether the robot moves off by itself, when, and what holds it."""

import pytest

from tests.tui import scenes
from tests.tui.console import console, plain, reduced, until
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import panels
from touchline.tui.key_bar import KeyBar, useless
from touchline.tui.panels import StatusPanel
from touchline.tui.protocol import Incoming
from touchline.tui.reduction import apply_event
from touchline.tui.signal_bar import SignalBar
from touchline.tui.state import ConsoleState

S, P = m.TraversalStatus, m.PauseStatus
NO_FIX = "the GNSS has no fix instead of an RTK-fixed one"


def at(time_s: float) -> Incoming:
    return received(topics.CLOCK, m.Clock(clock=scenes.header(time_s).stamp))


def paused(template: Template, reason: str = NO_FIX) -> Incoming:
    return received(topics.STATUS, scenes.status(template, S.PAUSED, reason=reason))


def pause(cause: int = P.LOCALIZATION, earliest_s: float | None = 103.0) -> Incoming:
    by_itself = earliest_s is not None
    earliest = scenes.header(earliest_s or 0.0).stamp
    return received(topics.PAUSE_STATUS, P(cause=cause, source="x", ends_by_itself=by_itself, earliest=earliest))


def warning(earliest_s: float) -> Incoming:
    return received(topics.ABOUT_TO_MOVE, m.AboutToMove(active=True, earliest=scenes.header(earliest_s).stamp))


def state(*events: Incoming) -> ConsoleState:
    found = reduced(events)
    found.speed_set(1.0)
    return found


def test_a_pause_that_ends_by_itself_counts_down_and_space_holds_it(template: Template) -> None:
    fix = received(topics.GNSS_STATUS, m.GnssStatus(fix=m.GnssStatus.NONE))
    shown = state(*scenes.mid_run(template), fix, at(100.0), pause(), paused(template))
    assert panels.hint(shown) == ("space", "hold: goes on in ≥ 3 s")
    assert "space" not in useless(shown)
    for event in (warning(102.0), pause(earliest_s=102.0), at(100.5)):
        apply_event(shown, event, 1.0)
    assert panels.hint(shown) == ("space", "hold: moves off in 2 s")
    apply_event(shown, at(101.5), 1.0)
    assert panels.hint(shown) == ("space", "hold: moves off in 1 s")


def test_the_countdown_is_by_the_clock_on_the_wall(template: Template) -> None:
    shown = state(*scenes.mid_run(template), at(100.0), pause(earliest_s=104.0), paused(template))
    shown.speed_set(2.0)
    assert shown.moves_off_in_s == pytest.approx(2.0)


@pytest.mark.parametrize("cause", [P.OPERATOR, P.LINK, P.WATCHDOG, P.HAZARD, P.FOLLOWER, P.EMERGENCY_STOP])
def test_a_pause_that_waits_for_a_person_says_what_to_do(template: Template, cause: int) -> None:
    shown = state(*scenes.mid_run(template), at(100.0), pause(cause, None), paused(template, "so"))
    assert panels.hint(shown) == ("g", "resume")
    assert "space" in useless(shown)
    assert (shown.waits_for_person, shown.paused_by_hand) == (True, cause == P.OPERATOR)


def test_a_robot_that_is_about_to_move_after_a_resume_says_so(template: Template) -> None:
    running = received(topics.STATUS, scenes.status(template, S.RUNNING, reason="about to move; keep clear"))
    shown = state(*scenes.mid_run(template), at(100.0), warning(102.0), running)
    assert panels.hint(shown) == ("space", "hold: moves off in 2 s")
    apply_event(shown, at(102.0), 1.0)
    assert panels.hint(shown) == ("space", "pause")


async def test_space_holds_it(template: Template) -> None:
    events = [*scenes.mid_run(template), at(100.0), pause(), paused(template)]
    async with console(*events, size=(80, 24)) as (app, link, pilot):
        app.state.speed_set(1.0)
        app.tick()
        assert "space  hold: goes on in ≥ 3 s" in plain(app, StatusPanel)
        assert "space Pause" in plain(app, KeyBar)
        await pilot.press("space")
        await until(pilot, lambda: link.names() == [topics.PAUSE.name])
        link.incoming += [pause(P.OPERATOR, None), paused(template, "paused by the operator")]
        await until(pilot, lambda: app.state.paused_by_hand)
        assert "g  resume" in plain(app, StatusPanel)
        await pilot.press("space")
        assert link.names() == [topics.PAUSE.name]
        assert "g goes on" in plain(app, SignalBar)
