"""Questions about motion are taken down when they no longer stand, so that a late answer moves nothing."""

import pytest

from tests.tui import fleets, scenes
from tests.tui.console import console, reduced, until
from tests.tui.scenes import FakeLinks, received
from tests.tui.test_unfinished_job import restarted
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.app import ConsoleApp
from touchline.tui.dialogs import ConfirmDialog
from touchline.tui.protocol import Incoming, NodeChanged
from touchline.tui.stop_screen import StopKey
from touchline.tui.void_question import TO_ABORT, TO_LOAD, TO_START, why_void

S = m.TraversalStatus
LARGE = m.PlanReport(paint_l=50.0, battery_wh=155.0)


def start_in_doubt(app: ConsoleApp, template: Template) -> None:
    app.state.choose_template(template, template.model_dump_json())
    app.state.planned(scenes.trajectory(template), LARGE)
    app.state.handed_over()


def asked_about(app: ConsoleApp, question: str) -> bool:
    return isinstance(app.screen, ConfirmDialog) and question in app.screen.question


QUESTIONS = {"s": "Start all the same?", "a": "Abort this job?", "l": "Begin anew?"}


def scene(key: str, template: Template) -> list[Incoming]:
    return {"s": scenes.loaded, "a": scenes.mid_run, "l": restarted}[key](template)


@pytest.mark.parametrize(("key", "how"), [("s", "e"), ("a", "ctrl+e"), ("l", "click")])
async def test_an_emergency_stop_takes_a_question_down_at_once(template: Template, key: str, how: str) -> None:
    async with console(*scene(key, template), size=(80, 24)) as (app, link, pilot):
        link.stops = False  # the robot's status need not tell of it
        if key == "s":
            start_in_doubt(app, template)
        await pilot.press(key)
        await until(pilot, lambda: asked_about(app, QUESTIONS[key]) and app.screen.query(StopKey))
        await (pilot.click(StopKey) if how == "click" else pilot.press(how))
        await until(pilot, lambda: not isinstance(app.screen, ConfirmDialog))
        await pilot.press("y")
        await pilot.pause()
        assert set(link.names()) <= {topics.ESTOP.name}
        told = [entry.text for entry in app.state.log.entries]
        assert f"{QUESTIONS[key]} Not asked any more: emergency stop" in told


def of_another_process(state: int) -> list[Incoming]:
    return [received(topics.STATUS, m.TraversalStatus(state=state), "robot-9")]


@pytest.mark.parametrize(
    ("key", "events", "reason"),
    [
        ("s", [received(topics.STATUS, m.TraversalStatus(state=S.ESTOPPED))], "emergency stop"),
        ("s", [NodeChanged(topics.ROBOT_SIM, False)], "the robot has gone"),
        ("s", of_another_process(S.IDLE), "the robot was restarted"),
        ("s", [received(topics.STATUS, m.TraversalStatus(state=S.RUNNING))], "the robot is RUNNING"),
        ("s", [], "nothing is heard of the robot"),
        ("a", [received(topics.STATUS, m.TraversalStatus(state=S.DONE))], "the robot is DONE"),
        ("a", [received(topics.STATUS, m.TraversalStatus(state=S.ABORTED))], "the robot is ABORTED"),
        ("a", [received(topics.STATUS, m.TraversalStatus(state=S.PAUSED))], ""),
        ("a", [], ""),
        ("l", [received(topics.STATUS, m.TraversalStatus(state=S.RUNNING), "robot-2")], "the robot is RUNNING"),
    ],
)
def test_what_becomes_of_the_robot_meanwhile_makes_it_void(
    template: Template, key: str, events: list[Incoming], reason: str
) -> None:
    state = reduced(scene(key, template))
    void = why_void(state, {"s": TO_START, "a": TO_ABORT, "l": TO_LOAD}[key])
    assert void() == ""
    reduced(events, state)
    state.now_s += 0.0 if events else 5.0
    assert void() == reason


async def test_it_is_taken_down_with_the_reason_and_a_late_answer_moves_nothing(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, link, pilot):
        await pilot.press("a")
        await until(pilot, lambda: asked_about(app, "Abort"))
        link.incoming.append(received(topics.STATUS, m.TraversalStatus(state=S.DONE)))
        await until(pilot, lambda: not isinstance(app.screen, ConfirmDialog))
        await pilot.press("y")
        await pilot.pause()
        assert not link.asked
        assert any(entry.text.endswith("Not asked any more: the robot is DONE") for entry in app.state.log.entries)


async def test_a_resume_of_all_is_not_asked_any_more_after_an_emergency_stop() -> None:
    links = fleets.fleet(3, S.PAUSED)
    for link in links.values():
        link.stops = False  # their status need not tell of it
    app = ConsoleApp(FakeLinks(links), clock=lambda: 1.0)
    async with app.run_test(size=(80, 24)) as pilot:
        app.tick()
        await pilot.press("x", "g")
        await until(pilot, lambda: asked_about(app, "Resume 3 of 3"))
        await pilot.press("e")
        await until(pilot, lambda: not isinstance(app.screen, ConfirmDialog))
        await pilot.press("y")
        await pilot.pause()
        assert all(topics.RESUME.name not in link.names() for link in links.values())
