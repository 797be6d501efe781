"""Thinned strokes of a covering tool: few points, the same ground, whole after a restart."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely

from tests.robot_sim.rolled import TICK_M, WIDTH_M, bend, line
from touchline.services.robot_sim.accounting.swept_ground import swept_ground
from touchline.services.robot_sim.paint import record
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.projection import POINT_COLUMNS, THIN_M
from touchline.services.robot_sim.world.body import STEPS, TRACE_SHAPE

EDGE_M = 1e-3


def ledger(*, thins: bool) -> PaintLedger:
    return PaintLedger([], WIDTH_M, WIDTH_M, thins=thins)


def roll(into: PaintLedger, points: np.ndarray, *, stop: bool = True) -> None:
    trace = np.zeros(TRACE_SHAPE)
    for before, after in pairwise(points):
        trace[:, :2], trace[1:, 2] = np.linspace(before, after, STEPS + 1), 1.0
        into.record(trace)
    if stop:
        trace[:, :2], trace[:, 2] = points[-1], 0.0
        into.record(trace)


def way() -> np.ndarray:
    """A lane, a turn as tight as it can be, a wiggle, a cusp after which it goes back, and on again, creeping."""
    lane = line((0.0, 0.0), (12.0, 0.0))
    turn = bend(12.0, 0.0, 0.0, 0.2731, math.pi / 0.2731)
    wiggle = np.column_stack((np.linspace(12.0, 6.0, 600), turn[-1, 1] + 0.1 * np.sin(np.linspace(0.0, 6.0, 600))))
    back = bend(6.0, wiggle[-1, 1], 0.3, -0.2, 5.0)
    creeping = line(back[-1], back[-1] - np.array([0.3, 0.1]), 0.1 * TICK_M)
    return np.vstack((lane, turn[1:], wiggle[1:], back[1:], creeping[1:]))


@pytest.mark.parametrize("turned_rad", [0.0, 1.0, 2.5])
def test_the_edge_of_what_is_rolled_stays_within_a_millimetre(turned_rad: float) -> None:
    cos, sin = math.cos(turned_rad), math.sin(turned_rad)
    points = way() @ np.array([[cos, sin], [-sin, cos]])
    whole, thin = ledger(thins=False), ledger(thins=True)
    roll(whole, points)
    roll(thin, points)
    assert thin.points < 0.25 * whole.points
    exact, kept = (swept_ground(each.strokes()).swept for each in (whole, thin))
    assert exact.area == pytest.approx(kept.area, rel=1e-4)
    assert exact.buffer(-EDGE_M).difference(kept).area < 1e-5, "none is lost"
    assert kept.difference(exact.buffer(EDGE_M)).area < 1e-5, "and none is made up"
    assert shapely.hausdorff_distance(exact.exterior, kept.exterior, densify=0.2) < 2.0 * EDGE_M


def test_where_it_is_now_is_known_at_once_and_told_once_it_is_settled() -> None:
    rolled = ledger(thins=True)
    roll(rolled, line((0.0, 0.0), (1.0, 0.0)), stop=False)
    roll(rolled, line((1.0, 0.0), (1.02, 0.0)), stop=False)
    assert rolled.strokes()[0].points[-1] == pytest.approx((1.02, 0.0))
    assert rolled.settled == rolled.points - 1
    (told,) = rolled.take_marks()
    assert 1.02 - THIN_M <= told.x_m[-1] <= 1.02
    roll(rolled, line((1.02, 0.0), (1.03, 0.0)))
    (rest,) = rolled.take_marks()
    assert rest.first_index == told.first_index + len(told.x_m) - 1
    assert (rest.x_m[0], rest.x_m[-1]) == (told.x_m[-1], pytest.approx(1.03))
    assert rolled.settled == rolled.points


@pytest.mark.parametrize(("stands_m", "strokes"), [(0.04, 1), (0.5, 2)])
def test_a_stroke_goes_on_after_a_restart_if_the_robot_is_where_it_was(stands_m: float, strokes: int) -> None:
    points = line((0.0, 0.0), (3.003, 0.0))
    first, second = ledger(thins=True), ledger(thins=True)
    roll(first, points, stop=False)
    kept = first.rows(0)[: first.settled].copy()
    start = (kept[-1, 0] + stands_m, 0.0)
    second.restore(kept, start)
    assert np.array_equal(second.rows(0), kept) and second.settled == len(kept)
    roll(second, line(start, (6.0, 0.0)))
    assert len(second.strokes()) == strokes
    assert np.array_equal(second.rows(0)[: len(kept)], kept), "what is kept does not change"


def test_a_day_of_rolling_fits(tmp_path) -> None:
    day_m, straight = 8.0 * 3600.0, ledger(thins=True)
    roll(straight, line((0.0, 0.0), (20.0, 0.0)))
    points = int(straight.points * day_m / 20.0)
    assert points * 8 * POINT_COLUMNS < record.LARGEST / 2
    kept = record.PaintRecord(tmp_path / "day.paint")
    kept.begin(b"0" * 16)
    for _ in range(points // 1000):
        kept.append(np.zeros((1000, POINT_COLUMNS)))
    assert kept.points == points // 1000 * 1000
    kept.close()
