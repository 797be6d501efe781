"""Things in the robot's way: on the map, in the panels, and the answers that an operator gives."""

import numpy as np
import pytest

from tests.tui import scenes
from tests.tui.console import console, plain, reduced, settle, shown_map, until
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Polygon, Template
from touchline.tui import panels
from touchline.tui.key_bar import KeyBar
from touchline.tui.map_raster import Ink
from touchline.tui.map_view import MapView
from touchline.tui.protocol import Incoming, PaintFetched
from touchline.tui.reduction import apply_event
from touchline.tui.signal_bar import SignalBar
from touchline.tui.state import ConsoleState

S, P, W = m.TraversalStatus, m.PauseStatus, m.WayRound


def at(time_s: float) -> Incoming:
    return received(topics.CLOCK, m.Clock(clock=scenes.header(time_s).stamp))


def way_round(state: int, goes_round_at_s: float = 0.0, **fields: object) -> Incoming:
    at = scenes.header(goes_round_at_s).stamp
    return received(topics.WAY_ROUND, W(state=state, things=("person 3",), goes_round_at=at, **fields))


def state(*events: Incoming) -> ConsoleState:
    found = reduced(events)
    found.speed_set(1.0)
    return found


def lines(shown: ConsoleState, width: int = 34) -> str:
    return "\n".join(line.plain for line in panels.status_lines(shown, width))


@pytest.fixture
def waiting(template: Template) -> list[Incoming]:
    return scenes.before_person(template)


def test_a_wait_says_before_what_how_far_and_when_it_ends(waiting: list[Incoming]) -> None:
    shown = state(*waiting)
    assert panels.hint(shown) == ("space", "hold: goes round in 8 s")
    text = lines(shown)
    assert "0.8 m from the robot" in text.replace("\n", " ")
    assert "before   person 3" in text and "unless told: 1 wait on" in text
    apply_event(shown, at(103.5), 1.0)
    assert panels.hint(shown) == ("space", "hold: goes round in 5 s")
    shown.speed_set(2.0)
    assert panels.hint(shown) == ("space", "hold: goes round in 3 s")


def test_later_drives_of_a_job_say_that_their_figures_are_their_own(waiting: list[Incoming]) -> None:
    assert "figures" not in lines(state(*waiting))
    assert "figures  of drive 2 alone" in lines(state(*waiting, way_round(W.DRIVES, drives=2)))


@pytest.mark.parametrize(
    ("told", "step", "asks"),
    [
        (way_round(W.WAITS), "goes on once its way is clear", True),
        (way_round(W.PLANS), "plans a way round", False),
        (way_round(W.FINDS_NO_WAY), "goes on once its way is clear", True),
        (way_round(W.DRIVES), "goes on once its way is clear", False),
    ],
)
def test_what_happens_next_is_what_the_robot_says(
    waiting: list[Incoming], told: Incoming, step: str, *, asks: bool
) -> None:
    shown = state(*waiting, told)
    assert panels.hint(shown) == ("space", f"hold: {step}")
    assert ("1 wait on" in lines(shown)) == asks and "unless" not in lines(shown)


def test_no_way_round_is_said_and_when_the_robot_searches_again(waiting: list[Incoming]) -> None:
    shown = state(*waiting, way_round(W.FINDS_NO_WAY, 140.0))
    assert "▲ finds no way round" in lines(shown) and "unless told: 1 wait on" in lines(shown)
    assert panels.hint(shown) == ("space", "hold: searches again in 40 s")


def test_a_wait_that_only_a_person_ends_says_so(waiting: list[Incoming]) -> None:
    shown = state(*waiting, way_round(W.WAITS), received(topics.PAUSE_STATUS, P(cause=P.IN_THE_WAY)))
    assert panels.hint(shown) == ("g", "resume")


def test_what_is_left_out_is_shown_in_metres_with_the_reasons(template: Template, waiting: list[Incoming]) -> None:
    stretch = m.LeftOutStretch(line_id="a", outline="person 3", from_m=2.0, to_m=3.5)
    other = m.LeftOutStretch(line_id="b", outline="operator", from_m=0.0, to_m=0.75)
    running = received(topics.STATUS, scenes.status(template, S.RUNNING))
    shown = state(*waiting, way_round(W.DRIVES, left_out=(stretch, other)), running)
    assert "left out 2.2 m  person 3, operator" in lines(shown, 40)
    assert "round    person 3" in lines(shown)


def test_ground_that_is_left_out_is_shown_in_square_metres(template: Template, waiting: list[Incoming]) -> None:
    patches = tuple(m.LeftOutPatch(area_id="yard", outline=name, size_m2=2.3) for name in ("person 3", "plan"))
    running = received(topics.STATUS, scenes.status(template, S.RUNNING))
    shown = state(*waiting, way_round(W.DRIVES, left_out_patches=patches), running)
    assert "left out 4.6 m²  person 3, plan" in lines(shown, 40)


def test_a_job_with_parts_left_out_does_not_end_as_complete(template: Template) -> None:
    stretch = m.LeftOutStretch(line_id="a", outline="person 3", from_m=2.0, to_m=3.5)
    shown = lines(state(*scenes.finished(template), way_round(W.DRIVES, drives=3, left_out=(stretch,))))
    assert "▲ with parts left out" in shown and "complete" not in shown
    assert "figures  of drive 3 alone" in shown


def test_the_end_of_one_drive_of_several_is_no_end_of_the_job(template: Template) -> None:
    shown = state(*scenes.finished(template), way_round(W.DRIVES, continues=True))
    assert panels.hint(shown) == ("", "the job goes on: the robot plans the rest")
    assert "result" not in lines(shown)


@pytest.mark.parametrize("counted_first", [True, False])
def test_paint_stays_when_the_robot_goes_round_and_not_when_it_begins_another_job(
    template: Template, *, counted_first: bool
) -> None:
    shown = state(way_round(W.DRIVES, drives=1), *scenes.mid_run(template))
    painted = len(shown.paint)
    plans = [received(topics.PLAN, each().trajectory) for each in (scenes.drive_response, scenes.leaving_response)]
    for drives, plan in enumerate(plans, start=2):
        apply_event(shown, way_round(W.PLANS, drives=drives - 1, continues=not counted_first), 1.0)
        told = way_round(W.DRIVES, drives=drives)
        for event in (told, plan) if counted_first else (plan, told):
            apply_event(shown, event, 1.0)
        apply_event(shown, PaintFetched(tuple(scenes.strokes(template, 1))), 1.0)
        assert len(shown.paint) > painted > 0
        painted = len(shown.paint)
    for event in (plans[0], way_round(W.DRIVES, drives=1), PaintFetched(())):
        apply_event(shown, event, 1.0)
    assert len(shown.paint) == 0


async def test_answers_have_keys_while_the_robot_waits(waiting: list[Incoming]) -> None:
    async with console(*waiting, size=(60, 18)) as (app, link, pilot):
        keys = plain(app, KeyBar)
        assert keys.startswith(" e E-STOP  1 Wait on  2 Go round  3 Leave out")
        await pilot.press("2")
        await until(pilot, lambda: link.names() == [topics.GO_ROUND.name])
        link.incoming.append(way_round(W.PLANS))
        await settle(pilot)
        assert "Go round" not in plain(app, KeyBar)
        await pilot.press("3")
        await settle(pilot)
        assert link.names() == [topics.GO_ROUND.name]
        assert "does not wait" in plain(app, SignalBar)


async def test_an_answer_goes_out_once_for_a_key_that_is_held_down(waiting: list[Incoming]) -> None:
    async with console(*waiting, size=(80, 24)) as (app, link, pilot):
        for _ in range(3):
            await pilot.press("1", "1", "1")
            await until(pilot, lambda: not app.state.orders.under_way("wait_on"))
        assert link.names() == [topics.WAIT_ON.name]
        link.incoming.append(way_round(W.WAITS))
        await settle(pilot)
        app.state.now_s += 5.0
        app.operator.command("wait_on")
        assert link.names() == [topics.WAIT_ON.name]
        await pilot.press("e")
        await until(pilot, lambda: topics.ESTOP.name in link.names())


async def test_the_map_shows_what_is_seen_and_what_is_known(waiting: list[Incoming], template: Template) -> None:
    bench = Polygon(id="bench", corners=((10.0, 10.0), (14.0, 10.0), (14.0, 12.0), (10.0, 12.0)))
    known = template.model_copy(update={"obstacles": (bench,)})
    told = received(topics.TEMPLATE, m.String(data=known.model_dump_json()))
    async with console(*waiting, told, size=(80, 24)) as (app, link, pilot):
        view = app.query_one(MapView)
        assert view.cells is not None
        assert {Ink.LIMIT, Ink.OBSTACLE, Ink.ABSENT} <= set(view.cells.inks.ravel().tolist())
        marks = {chr(code) for code in view.cells.codes[view.cells.inks == Ink.OBSTACLE].tolist()}
        assert marks == {"P", "W", "→"}
        assert "P→" in shown_map(app)
        link.incoming.append(at(102.0))
        await settle(pilot)
        assert Ink.OBSTACLE not in view.cells.inks, "seen too long ago"


async def test_the_map_shows_near_by_where_things_stop_the_robot_and_slow_it_down(waiting: list[Incoming]) -> None:
    async with console(*waiting, size=(80, 24)) as (app, link, pilot):
        view, zones = app.query_one(MapView), {Ink.STOP_ZONE, Ink.SLOW_ZONE}
        assert view.cells is not None
        assert not zones & set(view.cells.inks.ravel().tolist()), "a few dots would hide the field"
        await pilot.press("f", *["plus"] * 5)
        await settle(pilot)
        assert zones <= set(view.cells.inks.ravel().tolist())
        link.incoming.append(at(102.0))
        await settle(pilot)
        assert not zones & set(view.cells.inks.ravel().tolist()), "reported too long ago"


def test_an_unreadable_zone_is_counted_and_not_shown(template: Template) -> None:
    broken = m.PolygonMessage(points=(m.Point32(x=float("inf")),))
    shown = state(*scenes.mid_run(template), received(topics.STOP_ZONE, m.PolygonStamped(polygon=broken)))
    assert shown.rejected == 1 and not len(shown.zones.stop)


@pytest.mark.parametrize(
    "broken",
    [
        m.Obstacle(id=4, x_m=float("nan")),
        m.Obstacle(id=4, outline_x_m=np.zeros(3), outline_y_m=np.zeros(2)),
    ],
)
def test_unreadable_obstacles_are_counted_and_not_shown(template: Template, broken: m.Obstacle) -> None:
    shown = state(*scenes.mid_run(template), received(topics.OBSTACLES, m.Obstacles(obstacles=(broken,))))
    assert shown.rejected == 1 and shown.obstacles == ()


def test_a_replay_shows_them_and_offers_no_answers(waiting: list[Incoming]) -> None:
    shown = state(*waiting)
    shown.nodes[topics.ROBOT_SIM].alive = False
    apply_event(shown, scenes.up(topics.REPLAY)[0], 1.0)
    apply_event(shown, scenes.received(topics.OBSTACLES, scenes.obstacles(100.0)), 1.0)
    assert len(shown.obstacles) == 3
    assert "1 wait on" not in lines(shown)
