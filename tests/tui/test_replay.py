"""A replay in the console: as the live session was, and after a seek as if it had run there.

TOUCHLINE_SESSION names another recording of one robot that did its job to the end, such as that of a whole pitch.
"""

import os
import random
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.tui.console import console, plain, until
from touchline.bus import BusConfig
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.jobs.team.team_run import TeamRun
from touchline.recordings.replay.replay_source import ReplaySource
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.paint_history import PaintHistory
from touchline.schemas.replay_run import ReplayRun
from touchline.schemas.team import TeamScenario
from touchline.schemas.topics import Service
from touchline.services.bridge.replay_service import Playback, run_replay
from touchline.tui.fleet_rows import fleet_rows
from touchline.tui.key_bar import KeyBar
from touchline.tui.link import BusLink, open_links
from touchline.tui.panels import StatusPanel
from touchline.tui.protocol import Incoming, NodeChanged, Received
from touchline.tui.reduction import apply_event
from touchline.tui.robots import Robots
from touchline.tui.signal_bar import SignalBar
from touchline.tui.state import ConsoleState

SHIPPED = Path(__file__).resolve().parents[2] / "examples" / "sessions" / "stop-and-resume.mcap"
SESSION = Path(os.environ.get("TOUCHLINE_SESSION", SHIPPED))
RUN = ReplayRun(b"abcdef")


def received(topic: topics.Topic, message: m.Message, run: ReplayRun = RUN) -> Received:
    return Received(topic.name, message, run.publisher_id.hex())


def live(until_s: float, *, replayed: bool, session: Path = SESSION, robot: str = "") -> ConsoleState:
    """Knowledge of a console that has heard every message of the session, or of one of its robots, until then."""
    state, paint = ConsoleState(), PaintHistory()
    apply_event(state, NodeChanged(topics.REPLAY if replayed else topics.ROBOT_SIM, True), 0.0)
    for cue in ReplaySource(session).from_start():
        if cue.at_s > until_s:
            break
        if robot and cue.namespace != robot:
            continue
        publisher = RUN.publisher_id.hex() if replayed else "robot"
        apply_event(state, Received(cue.topic.name, decode(cue.topic.type, cue.payload), publisher), 0.0)
        if cue.topic is topics.PLAN:
            paint.clear()
        elif cue.topic is topics.PAINT:
            paint.add(cue.payload)
    state.paint.restore(paint.strokes())
    return state


def known(state: ConsoleState) -> dict[str, Any]:
    """The screen's text about a robot; its last motion tells of steered wheels alone, which it has not."""
    robot, painted = state.robot, state.paint.line
    told = {name: value for name, value in vars(robot).items() if name != "motion"}
    events = [
        (each.time_s, each.severity, each.text, each.times) for each in state.log.entries if each.time_s is not None
    ]
    job = state.template and state.template.text, state.path and state.path.trajectory
    ends = [painted.x_m[[0, -1]].tolist(), painted.y_m[[0, -1]].tolist()] if len(painted) else []
    return {**told, "events": events, "job": job, "strokes": int((~painted.joined).sum()), "ends": ends}


class Console:
    """A console's link and state, without its screen."""

    def __init__(self, link: BusLink) -> None:
        self.link, self.state = link, ConsoleState(closely=False)
        link.attend(closely=True)
        self.state.attend(closely=True)

    def until(self, what: Any) -> None:
        deadline = time.monotonic() + 300.0
        while not what(self.state) or self.state.paint.needs_fetch:
            assert time.monotonic() < deadline
            for event in self.link.poll():
                apply_event(self.state, event, time.monotonic())
            if self.state.paint.needs_fetch:
                self.state.paint.fetch_asked()
                self.link.fetch_paint()
            time.sleep(0.01)

    def seek(self, time_s: float) -> m.ReplayStatus:
        request = m.ReplaySeekRequest(request_id=str(time_s), time_s=time_s)
        jumps = self.state.replay.run.jumps if self.state.replay.run is not None else 0
        answer = self.link.call(topics.REPLAY_SEEK, request, 30.0)
        assert answer.success, answer
        self.until(lambda state: state.replay.status.jumps == state.replay.run.jumps == jumps + 1)
        status = self.state.replay.status
        assert status is not None
        return status


@contextmanager
def watched(session: Path, config: BusConfig) -> Iterator[dict[str, Console]]:
    """A console for each robot of a paused replay."""
    over = threading.Event()
    playback = Playback(speed=-1.0, paused=True, stay=True)
    thread = threading.Thread(target=run_replay, args=(session, playback, config), kwargs={"stop": over.is_set})
    thread.start()
    try:
        with open_links(config, topics.CONSOLE) as links:
            yield {name: Console(link) for name, link in links.found() if isinstance(link, BusLink)}
    finally:
        over.set()
        thread.join()


@pytest.fixture
def replay(bus_config: BusConfig) -> Iterator[Console]:
    """A console with a paused replay of the session."""
    with watched(SESSION, bus_config) as consoles:
        (console,) = consoles.values()
        yield console


def test_the_end_is_that_of_the_live_run_and_seeks_are_where_a_replay_ran(replay: Console) -> None:
    replay.until(lambda state: state.replayed and state.replay.status is not None)
    refused = replay.link.call(topics.START, m.CommandRequest(request_id="a"), 5.0)
    assert not refused.success and "is a replay" in refused.message
    assert replay.link.call(topics.REPLAY_RESUME, m.CommandRequest(request_id="b"), 5.0).success
    source = ReplaySource(SESSION)
    end_s = source.begin_s + source.length_s
    replay.until(lambda state: not state.replay.playing and state.replay.status.now_s == end_s and state.robot.report)
    settled = time.monotonic() + 0.3
    replay.until(lambda _: time.monotonic() > settled)
    end, run = known(replay.state), live(1e9, replayed=False)
    assert replay.state.robot.truth is not None and run.robot.truth is not None
    assert replay.state.robot.truth.coverage_pct == run.robot.truth.coverage_pct > 99.0
    assert end == known(run)
    draw = random.Random(3)
    for time_s in (draw.uniform(0.1, end_s) for _ in range(3)):
        status = replay.seek(time_s)
        assert (status.now_s, status.playing) == (time_s, False)
        settled = time.monotonic() + 0.2
        replay.until(lambda _, settled=settled: time.monotonic() > settled)
        assert known(replay.state) == known(live(time_s, replayed=True)), time_s


def test_robots_of_one_recording_are_sought_together(bus_config: BusConfig, tmp_path: Path) -> None:
    session, team = tmp_path / "team.mcap", TeamScenario(robots=2, duration_s=4.0)
    with PayloadRecorder(session, (*team.names, topics.TEAM_NAMESPACE)) as recorder:
        TeamRun(team, listener=recorder.hear).run()
    with watched(session, bus_config.of(*team.names)) as consoles:
        assert set(consoles) == set(team.names)
        for each in consoles.values():
            each.until(lambda state: state.replayed and state.replay.status is not None)
        one, other = (consoles[name] for name in team.names)
        for jumps, time_s in enumerate((3.0, 1.5), start=1):
            one.seek(time_s)  # whichever is told, all of the recording is there
            other.until(lambda state, jumps=jumps: state.replay.status.jumps == state.replay.run.jumps == jumps)
            for name, each in consoles.items():
                settled = time.monotonic() + 0.2
                each.until(lambda _, settled=settled: time.monotonic() > settled)
                assert each.state.replay.status.now_s == time_s
                told = live(time_s, replayed=True, session=session, robot=name)
                assert known(each.state) == known(told), (name, time_s)
                assert each.state.robot.pose is not None


def test_what_was_sent_before_a_jump_is_dropped_whenever_it_comes() -> None:
    state, after = ConsoleState(), RUN.next()
    apply_event(state, NodeChanged(topics.REPLAY, True), 0.0)
    apply_event(state, received(topics.REPORT, m.TraversalReport(success=True)), 0.0)
    apply_event(state, received(topics.EVENTS, m.Event(source="robot", text="done")), 0.0)
    apply_event(state, received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.RUNNING), after), 0.0)
    apply_event(state, received(topics.REPORT, m.TraversalReport(success=True)), 0.0)
    assert state.robot.report is None and state.traversal == m.TraversalStatus.RUNNING
    assert [entry.text for entry in state.log.entries] == ["replay is up"]


def test_a_paused_replay_is_no_stale_robot_and_its_status_acknowledges_no_stop() -> None:
    state = ConsoleState()
    apply_event(state, NodeChanged(topics.REPLAY, True), 0.0)
    state.orders.stop.press("a", "")
    apply_event(state, received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.ESTOPPED)), 0.0)
    assert not state.orders.stop.changes
    alive = m.DiagnosticArray(status=(m.DiagnosticStatus(name=topics.REPLAY, message="paused"),))
    apply_event(state, Received(topics.DIAGNOSTICS.name, alive, "x"), 10.0)
    assert state.robot_alive and not state.robot_stale


def test_a_stop_goes_to_robots_and_not_to_replays() -> None:
    robots = Robots({"a": ConsoleState(name="a"), "b": ConsoleState(name="b")}, "a")
    apply_event(robots.states["a"], NodeChanged(topics.REPLAY, True), 0.0)
    apply_event(robots.states["b"], NodeChanged(topics.ROBOT_SIM, True), 0.0)
    assert robots.to_stop() == ("b",)
    apply_event(robots.states["a"], NodeChanged(topics.ROBOT_SIM, True), 0.0)
    assert robots.to_stop() == ("a", "b")


async def test_the_screen_has_the_mark_and_keys_move_the_replay() -> None:
    async with console(*replaying(), size=(80, 24)) as (app, link, pilot):
        assert "REPLAY ► 0:12 of 1:40  5×" in plain(app, SignalBar)
        assert "REPLAY RUNNING" in plain(app, StatusPanel)
        assert "Template" not in plain(app, KeyBar)
        for key, service in (
            ("space", topics.REPLAY_PAUSE),
            ("less_than_sign", topics.REPLAY_SEEK),
            ("n", topics.REPLAY_STEP),
            ("right_square_bracket", topics.REPLAY_SET_SPEED),
        ):
            await pilot.press(key)
            await until(pilot, lambda service=service: service.name in link.names())
        sought = next(request for name, request in link.asked if name == topics.REPLAY_SEEK.name)
        assert sought.time_s == 2.0
        before = len(link.asked) + len(link.posted)
        for key, said in (("s", "Start: tt2 is a replay"), ("t", "is a replay"), ("e", "cannot be stopped")):
            await pilot.press(key)
            app.tick()
            await pilot.pause()
            assert said in app.state.log.entries[-1].text
        assert len(link.asked) + len(link.posted) == before


def replaying(*, playing: bool = True) -> list[Incoming]:
    told = m.ReplayStatus(file="s.mcap", end_s=100.0, now_s=12.0, speed=5.0, playing=playing)
    return [
        NodeChanged(topics.REPLAY, True),
        received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.RUNNING)),
        Received(topics.REPLAY_STATUS.name, told),
    ]


@pytest.mark.parametrize(
    ("keys", "service", "field", "wanted", "further"),
    [
        (["right_square_bracket"] * 3, topics.REPLAY_SET_SPEED, "factor", 50.0, 100.0),
        (["left_square_bracket"] * 3, topics.REPLAY_SET_SPEED, "factor", 0.5, 0.25),
        (["greater_than_sign"] * 3, topics.REPLAY_SEEK, "time_s", 42.0, 52.0),
    ],
)
async def test_keys_that_come_faster_than_answers_add_up(
    keys: list[str], service: Service[Any, Any], field: str, wanted: float, further: float
) -> None:
    """Also those that come after the answer, as long as the replay's status does not tell of it yet."""
    async with console(*replaying(), size=(80, 24)) as (app, link, pilot):
        link.held = threading.Event()
        await pilot.press(*keys)
        link.held.set()
        await until(pilot, lambda: getattr(link.asked[-1][1], field) == wanted)
        order = "replay-seek" if service is topics.REPLAY_SEEK else "replay-speed"
        await until(pilot, lambda: not app.state.orders.under_way(order))
        await pilot.press(keys[0])
        await until(pilot, lambda: getattr(link.asked[-1][1], field) == further)
        assert {name for name, _ in link.asked} == {service.name}


async def test_steps_and_pauses_that_come_faster_than_answers_and_status_are_all_made() -> None:
    async with console(*replaying(), size=(80, 24)) as (app, link, pilot):
        link.held = threading.Event()
        await pilot.press("n", "n", "n", "n")
        link.held.set()
        await until(pilot, lambda: len(link.asked) == 2)
        assert [request.seconds for _, request in link.asked] == pytest.approx([0.1, 0.3])
        link.asked.clear()
        await pilot.press("space")
        await until(pilot, lambda: link.asked and not app.state.orders.under_way("replay"))
        await pilot.press("space")
        await until(pilot, lambda: len(link.asked) == 2)
        assert link.names() == [topics.REPLAY_PAUSE.name, topics.REPLAY_RESUME.name]


async def test_a_paused_replay_does_not_say_that_anything_runs() -> None:
    async with console(*replaying(playing=False), size=(80, 24)) as (app, link, pilot):
        head, recorded = plain(app, StatusPanel).splitlines()[:2]
        assert head.strip() == "‖ REPLAY PAUSED" and recorded == "recorded: RUNNING"
        assert "go on with the replay" in plain(app, StatusPanel)
        assert fleet_rows(app.robots)[0].badge.text == "PAUSED"
        link.incoming += replaying()
        await until(pilot, lambda: "► REPLAY RUNNING" in plain(app, StatusPanel))
