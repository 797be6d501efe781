"""What the console looks like; `pytest --snapshot-update` takes new pictures, to be looked at before they are kept."""

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from textual.pilot import Pilot

from tests.tui import fleets, scenes
from tests.tui.scenes import FakeLink, FakeLinks
from tests.tui.test_unfinished_job import aborted
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.app import ConsoleApp
from touchline.tui.goal_draft import PlanAsked
from touchline.tui.protocol import Incoming, NodeChanged

Compare = Callable[..., bool]


def app_with(events: list[Incoming]) -> ConsoleApp:
    return ConsoleApp(FakeLink(incoming=list(events)), clock=lambda: 1.0)


def settled(*keys: str) -> Callable[[Pilot[Any]], Awaitable[None]]:
    async def run_before(pilot: Pilot[Any]) -> None:
        for _ in range(3):
            pilot.app.tick()  # type: ignore[attr-defined]
            await pilot.pause()
        await pilot.press(*keys)
        await pilot.pause()
        pilot.app.tick()  # type: ignore[attr-defined]
        await pilot.pause()

    return run_before


def test_disconnected(snap_compare: Compare) -> None:
    assert snap_compare(app_with([]), terminal_size=(120, 40), run_before=settled())


def test_plan_made(snap_compare: Compare, template: Template) -> None:
    app = app_with(scenes.up())
    app.state.choose_template(template, template.model_dump_json())
    response = scenes.plan_response(template)
    app.state.planned(response.trajectory, response.report)
    assert snap_compare(app, terminal_size=(120, 40), run_before=settled())


def test_mid_run(snap_compare: Compare, template: Template) -> None:
    assert snap_compare(app_with(scenes.mid_run(template)), terminal_size=(120, 40), run_before=settled())


def test_mid_run_wide(snap_compare: Compare, template: Template) -> None:
    assert snap_compare(app_with(scenes.mid_run(template)), terminal_size=(200, 60), run_before=settled())


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["narrow", "normal"])
def test_three_robots_of_which_one_has_not_acknowledged_a_stop(
    snap_compare: Compare, template: Template, size: tuple[int, int]
) -> None:
    links = {"r1": FakeLink(incoming=scenes.mid_run(template)), "club/r2": FakeLink(incoming=scenes.estopped(template))}
    links["r3"] = FakeLink(incoming=[*scenes.up(), scenes.received(topics.ODOMETRY, scenes.odometry(-20.0, 12.0, 2.0))])
    app = ConsoleApp(FakeLinks(links), clock=lambda: 1.0)
    app.robots.states["r3"].orders.stop.press("stop", "")
    assert snap_compare(app, terminal_size=size, run_before=settled())


def test_mid_run_narrow(snap_compare: Compare, template: Template) -> None:
    assert snap_compare(app_with(scenes.mid_run(template)), terminal_size=(80, 24), run_before=settled())


def test_following_closely(snap_compare: Compare, template: Template) -> None:
    keys = settled("f", *["plus"] * 9)
    assert snap_compare(app_with(scenes.mid_run(template)), terminal_size=(120, 40), run_before=keys)


def test_finished(snap_compare: Compare, template: Template) -> None:
    assert snap_compare(app_with(scenes.finished(template)), terminal_size=(120, 40), run_before=settled())


def test_emergency_stop(snap_compare: Compare, template: Template) -> None:
    assert snap_compare(app_with(scenes.estopped(template)), terminal_size=(120, 40), run_before=settled())


def test_a_frozen_robot_that_does_not_acknowledge_a_stop(snap_compare: Compare, template: Template) -> None:
    async def frozen(pilot: Pilot[Any]) -> None:
        await settled()(pilot)
        state = pilot.app.state  # type: ignore[attr-defined]
        state.orders.stop.press("a", "robot-1")
        state.orders.stop.tried("a", 9)
        state.now_s += 4.0
        await settled()(pilot)

    empty = scenes.received(topics.SPRAYER, m.SprayerState(tank_l=0.01))
    app = app_with([*scenes.mid_run(template), empty])
    assert snap_compare(app, terminal_size=(80, 24), run_before=frozen)


@pytest.mark.parametrize("key", ["t", "p", "a", "question_mark"])
def test_dialogs_fit_the_smallest_terminal(snap_compare: Compare, template: Template, key: str) -> None:
    events = scenes.mid_run(template) if key == "a" else scenes.loaded(template)
    assert snap_compare(app_with(events), terminal_size=(80, 24), run_before=settled(key))


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["narrow", "normal"])
def test_a_job_that_was_aborted(snap_compare: Compare, template: Template, size: tuple[int, int]) -> None:
    assert snap_compare(app_with(aborted(template)), terminal_size=size, run_before=settled())


def test_a_template_is_found_by_what_is_typed(snap_compare: Compare, template: Template) -> None:
    keys = settled("t", *"soccer", "tab")  # a cursor in the field would blink
    assert snap_compare(app_with(scenes.loaded(template)), terminal_size=(80, 24), run_before=keys)


def test_without_colours(snap_compare: Compare, template: Template, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    assert snap_compare(app_with(scenes.mid_run(template)), terminal_size=(120, 40), run_before=settled())


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["narrow", "normal"])
def test_aiming_at_a_goal(snap_compare: Compare, size: tuple[int, int]) -> None:
    link = FakeLink(incoming=[*scenes.standing(), *scenes.uncertain()])
    app = ConsoleApp(link, clock=lambda: 1.0)

    async def aimed(pilot: Pilot[Any]) -> None:
        await settled("d", *["right"] * 12, *["up"] * 6, *["<"] * 4)(pilot)
        answer = scenes.drive_response()
        app.state.drive.planned(answer.trajectory, answer.report, answer.message)
        await settled()(pilot)

    assert snap_compare(app, terminal_size=size, run_before=aimed)


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["narrow", "normal"])
def test_aiming_at_another_goal_amid_a_drive(snap_compare: Compare, size: tuple[int, int]) -> None:
    app = app_with([*scenes.standing(), *scenes.on_the_drive()])

    async def aimed(pilot: Pilot[Any]) -> None:
        await settled("d")(pilot)
        app.state.drive.place(9.0, 5.0)
        answer = scenes.leaving_response()
        app.state.drive.ask(PlanAsked("a", app.state.now_s, under_way=True))
        app.state.drive.planned(answer.trajectory, answer.report, answer.message)
        await settled("minus", "minus")(pilot)

    assert snap_compare(app, terminal_size=size, run_before=aimed)


def test_how_to_get_to_a_goal(snap_compare: Compare) -> None:
    assert snap_compare(app_with(scenes.standing()), terminal_size=(80, 24), run_before=settled("d", "m"))


def test_driving_to_a_goal(snap_compare: Compare) -> None:
    app = app_with([*scenes.standing(), *scenes.on_the_drive(), *scenes.uncertain(4.0)])
    assert snap_compare(app, terminal_size=(80, 24), run_before=settled())


def test_robot_gone_mid_run(snap_compare: Compare, template: Template) -> None:
    events = [*scenes.mid_run(template), NodeChanged(topics.ROBOT_SIM, False)]
    assert snap_compare(app_with(events), terminal_size=(120, 40), run_before=settled())


def test_the_pictures_are_of_what_they_say(template: Template) -> None:
    """The situations themselves, so that a wrong picture is not kept by mistake."""
    states = [
        (scenes.loaded(template), m.TraversalStatus.READY),
        (scenes.mid_run(template), m.TraversalStatus.RUNNING),
        (scenes.finished(template), m.TraversalStatus.DONE),
        (scenes.estopped(template), m.TraversalStatus.ESTOPPED),
    ]
    for events, state in states:
        app = app_with(events)
        for event in events:
            app.state.apply(event, 1.0)
        assert app.state.traversal == state


@pytest.mark.parametrize("size", [(80, 24), (200, 60)], ids=["narrow", "wide"])
def test_a_fleet_of_fifty_with_some_in_trouble(snap_compare: Compare, size: tuple[int, int]) -> None:
    links = fleets.fleet(50)
    links["r17"].incoming.append(NodeChanged(topics.ROBOT_SIM, False))
    links["r31"].incoming.append(scenes.received(topics.BATTERY, m.BatteryState(percentage=0.12)))
    app = ConsoleApp(FakeLinks(links), clock=lambda: 1.0)
    assert snap_compare(app, terminal_size=size, run_before=settled("v", "down", "down"))


def test_who_has_answered_an_order_to_all(snap_compare: Compare) -> None:
    app = ConsoleApp(FakeLinks(fleets.fleet(12, m.TraversalStatus.RUNNING)), clock=lambda: 1.0)

    async def stopped(pilot: Pilot[Any]) -> None:
        await settled("v")(pilot)
        for number, state in enumerate(app.robots.states.values()):
            state.orders.stop.press("a", "")
            if number not in (3, 7):
                state.orders.stop.status(m.TraversalStatus.ESTOPPED, "robot-1")
        app.robots.call_roll("estop", "Emergency stop", app.robots.states)
        for state in app.robots.states.values():
            state.now_s += 0.5
        await settled()(pilot)

    assert snap_compare(app, terminal_size=(80, 24), run_before=stopped)


def test_an_order_to_all_is_asked_for(snap_compare: Compare) -> None:
    app = ConsoleApp(FakeLinks(fleets.fleet(50)), clock=lambda: 1.0)
    assert snap_compare(app, terminal_size=(80, 24), run_before=settled("v", "x"))
