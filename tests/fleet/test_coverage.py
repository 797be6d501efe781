"""Coverage of areas that are not convex: known ways round corners, a cost that never rises, and the least there is."""

import itertools
import math

import numpy as np
import pytest
import shapely

from touchline.coordination.coverage import GeodesicCoverage, coverage_of
from touchline.coordination.density import DiscDensity, EvenDensity
from touchline.coordination.free_area import FreeArea
from touchline.coordination.lloyd import deployment, relaxed_targets
from touchline.coordination.point_shares import PointShares
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.team import TeamScenario

WALL_M, PITCH_M = 0.2, 0.1
KEPT_M = 0.22
"""Distance from walls of the ways."""
EVEN = EvenDensity()
U_RING = [(0, 0), (6, 0), (6, 6), (4, 6), (4, 2), (2, 2), (2, 6), (0, 6)]
DOORWAY = [[(3.9, -1), (4.1, -1), (4.1, 1.4), (3.9, 1.4)], [(3.9, 2.6), (4.1, 2.6), (4.1, 5), (3.9, 5)]]
ROOMS = FreeArea.of([(0, 0), (8, 0), (8, 4), (0, 4)], DOORWAY)
U_SHAPE = FreeArea.of(U_RING)
RING = FreeArea.of([(0, 0), (6, 0), (6, 6), (0, 6)], [[(2, 2), (4, 2), (4, 4), (2, 4)]])
AREAS = {"rooms": ROOMS, "U": U_SHAPE, "ring": RING}


def length_m(area: FreeArea, place: tuple[float, float], point: tuple[float, float]) -> float:
    return float(PointShares(area, WALL_M, np.array([point])).of(np.array([place])).lengths_m[0])


@pytest.mark.parametrize(
    ("area", "place", "point", "corners"),
    [
        (ROOMS, (1.0, 1.0), (3.0, 3.0), ()),
        (ROOMS, (2.0, 0.5), (6.0, 0.5), ((3.9, 1.4), (4.1, 1.4))),
        (U_SHAPE, (1.0, 5.0), (5.0, 5.0), ((2, 2), (4, 2))),
        (RING, (3.0, 1.0), (3.0, 5.0), ((2, 2), (2, 4))),
    ],
)
def test_a_way_is_as_long_as_it_must_be(
    area: FreeArea, place: tuple[float, float], point: tuple[float, float], corners: tuple[tuple[float, float], ...]
) -> None:
    around = shapely.union_all([shapely.Point(place), shapely.Point(point), shapely.MultiPoint(corners).buffer(KEPT_M)])
    straight_m = math.dist(place, point)
    least_m = around.convex_hull.length - straight_m if corners else straight_m  # a string round the corners
    found_m = length_m(area, place, point)
    assert least_m - 1e-9 <= found_m <= 1.02 * least_m


def test_what_is_behind_a_wall_belongs_to_who_is_on_its_side() -> None:
    points = np.array([(1.5, 5.0), (4.5, 5.0), (0.5, 0.5), (5.5, 0.5)])
    shares = PointShares(U_SHAPE, WALL_M, points).of(np.array([(1.0, 3.0), (4.3, 5.5)]))
    assert shares.owners.tolist() == [0, 1, 0, 1]
    assert shares.stretch[:2].tolist() == [1.0, 1.0]
    straight = np.linalg.norm(points[:1] - np.array([(1.0, 3.0), (2.9, 5.5)]), axis=1)
    assert straight.argmin() == 1  # nearer across the wall


def test_points_that_nobody_can_reach_belong_to_nobody() -> None:
    closed = FreeArea.of([(0, 0), (6, 0), (6, 3), (0, 3)], [[(2.9, -1), (3.1, -1), (3.1, 2.8), (2.9, 2.8)]])
    points = np.array([(1.0, 2.0), (5.0, 2.0)])
    assert PointShares(closed, WALL_M, points).of(np.array([(1.0, 1.0)])).owners.tolist() == [0, -1]
    found = GeodesicCoverage(closed, EVEN, WALL_M).deployment(np.array([(1.0, 1.0)]))
    assert found.centroids[0] == pytest.approx((1.45, 1.5), abs=0.1)


def test_in_a_convex_area_all_is_as_by_lloyds_rule_to_the_bit() -> None:
    area = FreeArea.of([(0, 0), (4, 0), (4, 3), (1, 5)])
    places = np.random.default_rng(1).uniform(1.0, 2.5, (5, 2))
    density = DiscDensity(((2.0, 2.0, 0.7, 3.0),))
    rule, wanted = coverage_of(area, density, WALL_M), deployment(places, area, density)
    assert rule.deployment(places).centroids.tobytes() == wanted.centroids.tobytes()
    assert rule.deployment(places).cost == wanted.cost
    assert rule.goals(places).tobytes() == relaxed_targets(places, wanted.centroids).tobytes()
    shares = PointShares(area, WALL_M, places).of(places + 0.1)
    assert (shares.leads is places, shares.stretch.tolist()) == (True, [1.0] * 5)


def test_where_all_is_seen_cost_and_centroid_are_those_of_polygons() -> None:
    notched = FreeArea.of([(0, 0), (4, 0), (4, 4), (2.05, 4), (2, 3.9), (1.95, 4), (0, 4)])
    places = np.array([(1.0, 1.5), (3.0, 2.0)])
    found, exact = GeodesicCoverage(notched, EVEN, 0.01).deployment(places), deployment(places, notched)
    assert found.cost == pytest.approx(exact.cost, rel=0.02)
    assert found.centroids == pytest.approx(exact.centroids, abs=0.02)


@pytest.mark.parametrize("name", AREAS)
def test_the_cost_never_rises_and_nobody_leaves_the_area(name: str) -> None:
    area, rng = AREAS[name], np.random.default_rng(3)
    rule = GeodesicCoverage(area, EVEN, WALL_M)
    low, high = area.hull.min(axis=0), area.hull.max(axis=0)
    for robots in (1, 2, 5, 9):
        places = rng.uniform(low, high, (200, 2))
        places = places[area.holds(places, WALL_M)][:robots]
        costs = []
        for _ in range(40):
            costs.append(rule.deployment(places).cost)
            step = rule.goals(places) - places
            places = places + step * np.minimum(1.0, 0.2 / np.maximum(np.hypot(*step.T), 0.2))[:, None]
            assert area.holds(places, WALL_M - 2e-3).all()
        assert np.diff(costs).max() <= 0.005 * costs[-1]
        assert costs[-1] < costs[0]


def least_cost(area: FreeArea, robots: int) -> float:
    """The least cost of robots at any of many places."""
    rule, grid = GeodesicCoverage(area, EVEN, WALL_M), np.arange(0.25, 6.0, 0.5)
    places = np.array(list(itertools.product(grid, grid)))
    places = places[area.holds(places, WALL_M)]
    away = np.array([rule._shares.of(place[None]).lengths_m ** 2 for place in places])
    least = math.inf
    for some in itertools.combinations(range(len(places) - 1), robots - 1):
        nearest, others = np.minimum.reduce(away[list(some)]), away[some[-1] + 1 :]
        least = min(least, float(np.minimum(others, nearest).sum(axis=1).min()) * PITCH_M**2)
    return least


@pytest.fixture(scope="module")
def least_of_u() -> float:
    return least_cost(U_SHAPE, 3)


@pytest.mark.xdist_group("team")
@pytest.mark.parametrize("avoid", ["cells", "plans"])
def test_emulated_robots_spread_round_the_corners_of_a_u(avoid: str, least_of_u: float) -> None:
    places = {f"tb{k}": {"x_m": 0.7, "y_m": 4.2 + 0.6 * k, "heading_rad": 0.0} for k in range(3)}
    team = {"area": {"outline": U_RING}, "places": places, "avoid": avoid, "duration_s": 60.0}
    run = TeamRun(TeamScenario.model_validate(team))
    run.run()
    figures, costs = team_figures(run, 1.0), np.array(run.trace.cost)
    assert figures["success"], figures["reason"]
    assert figures["beyond_walls_robot_s"] == 0.0
    assert costs[-1] <= 1.01 * least_of_u
    assert np.diff(costs).max() <= 0.005 * costs[-1]
