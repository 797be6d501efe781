"""Silence: a process that says nothing any more is shown as such within a second, and never as running."""

from tests.tui import scenes
from tests.tui.console import console, plain, reduced, until
from tests.tui.scenes import FakeLink, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import panels, theme
from touchline.tui.app import ConsoleApp
from touchline.tui.header import HeaderBar, header_line
from touchline.tui.map_view import MapView
from touchline.tui.node_health import Freshness
from touchline.tui.panels import StatusPanel
from touchline.tui.protocol import Incoming, NodeChanged, Received, Skimmed
from touchline.tui.reduction import apply_event


def robot_says(**values: object) -> Incoming:
    return received(topics.DIAGNOSTICS, scenes.diagnostics(topics.ROBOT_SIM, **values))


def test_a_frozen_robot_is_seen_within_a_second(template: Template) -> None:
    state = reduced(scenes.mid_run(template), now_s=10.0)
    assert panels.badge(state) == theme.STATES[m.TraversalStatus.RUNNING]
    state.now_s += 0.7
    assert panels.badge(state).color == theme.ORANGE
    state.now_s += 1.3
    assert panels.badge(state).text == "RUNNING? silent for 2 s"
    for width in (80, 120, 200):
        header = header_line(state, width)
        assert "▲ robot 2 s?" in header.plain
        assert "● robot" not in header.plain
    lines = panels.status_lines(state, 40)
    (speed,) = [line for line in lines if line.plain.startswith("speed")]
    assert {span.style for span in speed.spans} == {theme.MUTED}
    assert panels.hint(state) == ("e", "stop; keep clear of the robot")
    assert panels.service_lines(state, 40)[1].plain == "▲ robot      STALE 2.0 s"
    state.now_s += 2.0
    assert panels.service_lines(state, 40)[1].plain == "▲ robot      NO ANSWER SINCE 4 s"


def test_diagnostics_that_are_not_read_are_a_word_of_the_process_that_they_were_of_before() -> None:
    told = Received(topics.DIAGNOSTICS.name, scenes.diagnostics(topics.ROBOT_SIM), "robot-1")
    others = Received(topics.DIAGNOSTICS.name, scenes.diagnostics(topics.PLANNER), "planner-1")
    state = reduced([*scenes.up(), told, others], now_s=10.0)
    state.now_s += 5.0
    for publisher in ("planner-1", "a stranger"):
        apply_event(state, Skimmed(topics.DIAGNOSTICS.name, publisher), state.now_s)
        assert state.robot_stale
    assert state.nodes[topics.PLANNER].freshness(state.now_s) is Freshness.LIVE
    apply_event(state, Skimmed(topics.DIAGNOSTICS.name, "robot-1"), state.now_s)
    assert state.robot_freshness is Freshness.LIVE


def test_a_word_of_the_robots_own_loop_makes_it_live_again(template: Template) -> None:
    words = (
        robot_says(speed_factor=0.0),  # held: sim time stands still, the loop does not
        received(topics.CLOCK, m.Clock()),
    )
    for word in words:
        state = reduced(scenes.mid_run(template), now_s=10.0)
        state.now_s += 5.0
        assert state.robot_stale
        apply_event(state, word, state.now_s)
        assert state.robot_freshness is Freshness.LIVE
    state.now_s += 5.0
    apply_event(state, received(topics.SUPERVISOR_EVENTS, m.Event(text="not the robot")), state.now_s)
    apply_event(state, received(topics.CLAIMED, m.NavPath(poses=(m.PoseStamped(),))), state.now_s)
    assert state.robot_stale


def test_a_process_that_starts_is_neither_live_nor_silent() -> None:
    state = reduced([NodeChanged(topics.ROBOT_SIM, True)], now_s=10.0)
    state.now_s += 5.0
    assert state.robot_freshness is Freshness.STARTING
    assert panels.service_lines(state, 40)[1].plain == "◔ robot      no report yet for 5 s"
    compiling = scenes.diagnostics(topics.ROBOT_SIM, "starting: compiling kernels")
    apply_event(state, received(topics.DIAGNOSTICS, compiling), state.now_s)
    state.now_s += 30.0
    assert state.robot_freshness is Freshness.STARTING
    assert "compiling" in panels.service_lines(state, 40)[1].plain


def test_what_is_compiled_before_a_robot_is_ready_is_told_at_every_size() -> None:
    state = reduced([NodeChanged(topics.ROBOT_SIM, True), NodeChanged(topics.PLANNER, True)], now_s=10.0)
    said = "starting: compiling 5 of 6 (rehearsal): fast_runner.run_nominal_ticks"
    apply_event(state, received(topics.DIAGNOSTICS, scenes.diagnostics(topics.ROBOT_SIM, said)), state.now_s)
    loading = scenes.diagnostics(topics.PLANNER, "starting: loading kernels")
    apply_event(state, received(topics.DIAGNOSTICS, loading), state.now_s)
    badge, robot, planner, *_ = [line.plain.strip() for line in panels.status_lines(state, 38)]
    assert badge == "◔ STARTING"
    assert (robot, planner) == ("robot: compiling 5 of 6 (rehearsal)", "planner: loading kernels")
    assert panels.status_lines(state, 31)[1].plain == "robot: compiling 5 of 6 (rehea…"
    assert panels.service_lines(state, 46)[1].plain == "◔ robot      starting: compiling 5 of 6 (rehe…"
    ready = scenes.diagnostics(topics.ROBOT_SIM, "ok")
    apply_event(state, received(topics.DIAGNOSTICS, ready), state.now_s)
    assert panels.badge(state) == theme.WAITING
    assert "compiling" not in " ".join(line.plain for line in panels.status_lines(state, 38))


def test_a_process_that_is_gone_is_gone(template: Template) -> None:
    state = reduced([*scenes.mid_run(template), NodeChanged(topics.ROBOT_SIM, False)], now_s=10.0)
    assert state.robot_freshness is Freshness.GONE
    assert panels.badge(state) == theme.NO_ROBOT
    assert "touchline up  starts one" in [line.plain for line in panels.status_lines(state, 31)]
    apply_event(state, NodeChanged(topics.SUPERVISOR, True), state.now_s)
    assert "touchline up" not in " ".join(line.plain for line in panels.status_lines(state, 31))


async def test_a_console_that_was_away_takes_nobody_for_silent(template: Template) -> None:
    now = [0.0]
    app = ConsoleApp(FakeLink(incoming=list(scenes.mid_run(template))), clock=lambda: now[0])
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "RUNNING" in plain(app, StatusPanel))
        now[0] = 30.0
        app.tick()
        assert not app.state.robot_stale
        for _ in range(10):
            now[0] += 0.1
            app.tick()
        assert app.state.robot_stale


async def test_silence_is_on_the_screen(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, _link, pilot):
        app.state.now_s += 2.0
        app.tick()
        await pilot.pause()
        assert "RUNNING? silent for 2 s" in plain(app, StatusPanel)
        assert "▲ robot 2 s?" in plain(app, HeaderBar)
        assert "heard last" in str(app.query_one(MapView).border_title)
