"""The rest of a job, after an abort or a restart of the robot: offered, and not painted anew by mistake."""

import pytest

from tests.robot_sim.rolled import roller
from tests.tui import fleets, scenes
from tests.tui.console import console, last, plain, reduced, until
from tests.tui.scenes import FakeLinks, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import supply_check
from touchline.tui.app import ConsoleApp
from touchline.tui.autostart import AutoStart
from touchline.tui.dialogs import ConfirmDialog
from touchline.tui.fleet_rows import Trouble, fleet_rows
from touchline.tui.key_bar import useless
from touchline.tui.panels import StatusPanel, hint
from touchline.tui.protocol import Incoming
from touchline.tui.reduction import apply_event
from touchline.tui.state import ConsoleState

S = m.TraversalStatus


def unfinished(reason: str = "the robot was restarted", done_pct: float = 14.6, name: str = "soccer-11") -> Incoming:
    job = m.UnfinishedJob(name=name, done_pct=done_pct, arc_length_m=340.0, total_length_m=2400.0, reason=reason)
    return received(topics.UNFINISHED, job)


def resting(state: int = S.IDLE, **fields: object) -> Incoming:
    return received(topics.STATUS, m.TraversalStatus(state=state, **fields))


def next_morning() -> list[Incoming]:
    """The services were started again, and so was the console: nobody has a plan but the robot."""
    return [*scenes.up(), received(topics.DIAGNOSTICS, scenes.diagnostics(topics.ROBOT_SIM)), resting(), unfinished()]


def aborted(template: Template) -> list[Incoming]:
    reason = "aborted by the operator"
    return [
        *scenes.mid_run(template),
        received(topics.STATUS, scenes.status(template, S.ABORTED, 14, 0.55, reason=reason)),
        unfinished(reason),
    ]


def restarted(template: Template) -> list[Incoming]:
    """Its process died amid the job, and another one is there."""
    told = [resting(), unfinished()]
    return [*scenes.mid_run(template), *(received(topics.TOPIC_BY_NAME[e.topic], e.message, "robot-2") for e in told)]


@pytest.mark.parametrize("scene", ["next_morning", "aborted", "restarted"])
async def test_to_go_on_is_the_next_step(template: Template, scene: str) -> None:
    events = {"next_morning": next_morning(), "aborted": aborted(template), "restarted": restarted(template)}[scene]
    async with console(*events, size=(80, 24)) as (app, _, _):
        assert hint(app.state) == ("g", "go on: 14 % painted")
        assert " g  go on: 14 % painted" in plain(app, StatusPanel)
        assert "g" not in useless(app.state)
        other = {"next_morning": "t  another job", "aborted": "r  reset", "restarted": "l  the whole job anew"}[scene]
        assert other in plain(app, StatusPanel)
        lines = plain(app, StatusPanel).splitlines()
        assert max(map(len, lines)) <= app.query_one(StatusPanel).content_size.width


async def test_one_key_loads_the_rest_and_starts_it_once_the_robot_has_it() -> None:
    async with console(*next_morning(), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.LOAD.name] = m.LoadResponse(success=True, message="loaded, to go on at 340.00 m")
        await pilot.press("g")
        await until(pilot, lambda: "to go on at" in last(app)[1])
        app.tick()
        await pilot.pause()
        ((name, request),) = link.asked
        assert (name, request.resume, request.trajectory.path.segments) == (topics.LOAD.name, True, ())
        link.incoming.append(resting(S.READY, coverage_pct=14.6, arc_length_m=340.0, total_length_m=2400.0))
        await until(pilot, lambda: topics.START.name in link.names())
        link.incoming.append(resting(S.READY))
        app.tick()
        await pilot.pause()
        assert link.names() == [topics.LOAD.name, topics.START.name], "once"


@pytest.mark.parametrize("key", ["", "e", "space"])
async def test_a_refusal_or_a_stop_in_between_starts_nothing(key: str) -> None:
    async with console(*next_morning(), size=(80, 24)) as (app, link, pilot):
        link.stops = False
        if not key:
            link.answers[topics.LOAD.name] = m.LoadResponse(success=False, message="seed was 1, is 7")
        await pilot.press("g")
        await until(pilot, lambda: ("Go on" if key else "seed was 1, is 7") in last(app)[1])
        await pilot.press(*([key] if key else []))
        link.incoming.append(resting(S.READY))
        app.tick()
        await pilot.pause()
        assert topics.START.name not in link.names()


def test_a_rest_needs_what_is_left_to_do(template: Template) -> None:
    state = reduced([*scenes.loaded(template), *scenes.robot_health(tank_l=19.0)])
    state.choose_template(template, template.model_dump_json())
    state.planned(scenes.trajectory(template), m.PlanReport(paint_l=20.0, battery_wh=100.0))
    state.handed_over()
    fields = {"reason": "", "coverage_pct": 50.0, "arc_length_m": 1200.0}
    apply_event(state, received(topics.STATUS, scenes.status(template, S.READY, **fields)), 0.0)
    assert supply_check.of_job(state).shortages == ()
    reduced(scenes.robot_health(tank_l=3.0), state)
    assert len(supply_check.of_job(state).shortages) == 1


@pytest.mark.parametrize("yes", [False, True])
async def test_to_load_anew_over_a_job_that_is_partly_painted_asks(template: Template, yes: bool) -> None:
    async with console(*restarted(template), size=(80, 24)) as (app, link, pilot):
        await pilot.press("l")
        await until(pilot, lambda: isinstance(app.screen, ConfirmDialog))
        assert "soccer-11 is 14 % painted" in app.screen._text
        await pilot.press("y" if yes else "enter")
        await until(pilot, lambda: not isinstance(app.screen, ConfirmDialog))
        await pilot.pause()
        assert [request.resume for name, request in link.asked] == ([False] if yes else [])


async def test_a_start_by_itself_never_paints_anew(template: Template) -> None:
    autostart = AutoStart("soccer-11", run=True)
    async with console(*next_morning(), autostart=autostart) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await until(pilot, lambda: "g goes on with it" in last(app)[1])
        assert not autostart.under_way
        assert topics.LOAD.name not in link.names()


async def test_another_job_in_preparation_comes_next_and_the_rest_is_still_offered(
    template: Template,
) -> None:
    async with console(*next_morning(), size=(80, 24)) as (app, _, _):
        other = template.model_copy(update={"name": "other"})
        app.state.choose_template(other, other.model_dump_json())
        app.tick()
        assert hint(app.state)[0] == "p"
        assert "g  go on with soccer-11" in plain(app, StatusPanel)


def test_areas_are_covered_and_what_is_done_or_under_way_is_not_offered() -> None:
    state = reduced(next_morning(), ConsoleState(vehicle=roller()))
    assert hint(state) == ("g", "go on: 14 % covered")
    for told in (unfinished(done_pct=100.0), received(topics.UNFINISHED, m.UnfinishedJob())):
        apply_event(state, told, 0.0)
    assert hint(state)[0] == "t"
    apply_event(state, unfinished(), 0.0)
    for traversal, key in ((S.RUNNING, "space"), (S.ESTOPPED, "r")):
        apply_event(state, resting(traversal), 0.0)
        assert hint(state)[0] == key


async def test_the_fleet_tells_which_robots_have_a_rest_and_the_key_is_for_the_picked_one() -> None:
    links = fleets.fleet(3)
    links["r02"].incoming += [resting(), unfinished()]
    app = ConsoleApp(FakeLinks(links), clock=lambda: 1.0)
    async with app.run_test(size=(120, 40)) as pilot:
        app.tick()
        rows = {row.name: row for row in fleet_rows(app.robots)}
        assert rows["r02"].trouble == Trouble.HALTED and "14 % painted, g goes on" in rows["r02"].alert
        assert "g goes on" not in rows["r01"].alert
        app.robots.select("r02")
        await pilot.press("v", "g")
        await until(pilot, lambda: links["r02"].names() == [topics.LOAD.name])
        assert links["r02"].asked[0][1].resume
