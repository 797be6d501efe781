"""Pictures of the console; `pytest --snapshot-update` takes new ones, to be looked at before they are kept."""

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from textual.pilot import Pilot

from tests.tui import fleets, scenes
from tests.tui.console import settle
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
        await settle(pilot)
        if keys:
            await pilot.press(*keys)
            await pilot.pause()
            await settle(pilot)

    return run_before


def of_template(situation: Callable[[Template], list[Incoming]]) -> Callable[[], ConsoleApp]:
    return lambda: app_with(situation(scenes.pitch()))


def of_events(*events: Incoming) -> Callable[[], ConsoleApp]:
    return lambda: app_with([*events])


def robot_gone(template: Template) -> list[Incoming]:
    return [*scenes.mid_run(template), NodeChanged(topics.ROBOT_SIM, False)]


NARROW, NORMAL, WIDE = (80, 24), (120, 40), (200, 60)
PICTURES: dict[str, tuple[Callable[[], ConsoleApp], tuple[int, int], tuple[str, ...]]] = {
    "disconnected": (of_events(), NORMAL, ()),
    "mid-run, narrow": (of_template(scenes.mid_run), NARROW, ()),
    "mid-run, wide": (of_template(scenes.mid_run), WIDE, ()),
    "following closely": (of_template(scenes.mid_run), NORMAL, ("f", *["plus"] * 9)),
    "finished": (of_template(scenes.finished), NORMAL, ()),
    "emergency stop": (of_template(scenes.estopped), NORMAL, ()),
    "robot gone mid-run": (of_template(robot_gone), NORMAL, ()),
    "aborted, narrow": (of_template(aborted), NARROW, ()),
    "abort": (of_template(scenes.mid_run), NARROW, ("a",)),
    "template": (of_template(scenes.loaded), NARROW, ("t",)),
    "plan": (of_template(scenes.loaded), NARROW, ("p",)),
    "keys": (of_template(scenes.loaded), NARROW, ("question_mark",)),
    "how to get to a goal": (of_events(*scenes.standing()), NARROW, ("d", "m")),
    "driving to a goal": (of_events(*scenes.standing(), *scenes.on_the_drive(), *scenes.uncertain(4.0)), NARROW, ()),
    "before a person": (of_template(scenes.before_person), NARROW, ("f", *["plus"] * 5)),
    "order to all": (lambda: ConsoleApp(FakeLinks(fleets.fleet(50)), clock=lambda: 1.0), NARROW, ("v", "x")),
}

IN_FULL_SIZES = pytest.mark.parametrize(
    "size", [pytest.param(NARROW, id="narrow"), pytest.param(NORMAL, id="normal", marks=pytest.mark.full)]
)


@pytest.mark.parametrize("name", PICTURES)
def test_it_looks_like_this(snap_compare: Compare, name: str) -> None:
    app, size, keys = PICTURES[name]
    assert snap_compare(app(), terminal_size=size, run_before=settled(*keys))


def test_plan_made(snap_compare: Compare, template: Template) -> None:
    app = app_with(scenes.up())
    app.state.choose_template(template, template.model_dump_json())
    response = scenes.plan_response(template)
    app.state.planned(response.trajectory, response.report)
    assert snap_compare(app, terminal_size=(120, 40), run_before=settled())


@IN_FULL_SIZES
def test_three_robots_of_which_one_has_not_acknowledged_a_stop(
    snap_compare: Compare, template: Template, size: tuple[int, int]
) -> None:
    links = {"r1": FakeLink(incoming=scenes.mid_run(template)), "club/r2": FakeLink(incoming=scenes.estopped(template))}
    links["r3"] = FakeLink(incoming=[*scenes.up(), scenes.received(topics.ODOMETRY, scenes.odometry(-20.0, 12.0, 2.0))])
    app = ConsoleApp(FakeLinks(links), clock=lambda: 1.0)
    app.robots.states["r3"].orders.stop.press("stop", "")
    assert snap_compare(app, terminal_size=size, run_before=settled())


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


@IN_FULL_SIZES
def test_aiming_at_a_goal(snap_compare: Compare, size: tuple[int, int]) -> None:
    link = FakeLink(incoming=[*scenes.standing(), *scenes.uncertain()])
    app = ConsoleApp(link, clock=lambda: 1.0)

    async def aimed(pilot: Pilot[Any]) -> None:
        await settled("d", *["right"] * 12, *["up"] * 6, *["<"] * 4)(pilot)
        answer = scenes.drive_response()
        app.state.drive.planned(answer.trajectory, answer.report, answer.message)
        await settled()(pilot)

    assert snap_compare(app, terminal_size=size, run_before=aimed)


@IN_FULL_SIZES
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


@pytest.mark.parametrize(
    "size", [pytest.param(NARROW, id="narrow"), pytest.param(WIDE, id="wide", marks=pytest.mark.full)]
)
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
