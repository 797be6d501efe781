"""F7: ten thousand updates of teams that drive anyhow; each stays in its cell, and no two come nearer than they may."""

import math

import numpy as np

from tests.fleet.all_at_once import buffered_cells, stopping_segments
from tests.fleet.teams import PERIOD_S, corner_grid, seeds, square
from tests.fleet.unicycles import LIMITS, drive

RADIUS_M = 0.2
TEAMS, UPDATES = 50, 200


def worst_of_team(robots: int, seed: int, updates: int) -> tuple[float, float]:
    """The closest two robots ever were (m), and how far (m) a stopping segment was ever outside its new cell.

    Goals are drawn anew for a tenth of the robots at every update, and robots drive straight at them whatever is in
    the way; only the rule of motion holds them.
    """
    rng = np.random.default_rng(seed)
    area = square(max(1.6, 0.9 * math.sqrt(robots)))
    side = area.hull.max()
    states = corner_grid(robots, apart_m=min(0.48, (side - 0.6) / math.ceil(math.sqrt(robots))))
    states[:, 2] = rng.uniform(-math.pi, math.pi, robots)
    goals = rng.uniform(0.0, side, (robots, 2))
    closest, outside = math.inf, -math.inf
    for _ in range(updates):
        segments = stopping_segments(states, LIMITS.acceleration_mps2)
        cells = buffered_cells(segments, area, RADIUS_M)
        outside = max(outside, *(cell.excess_m(row) for cell, row in zip(cells, segments, strict=True)))
        new = rng.uniform(0.0, 1.0, robots) < 0.1
        goals[new] = rng.uniform(0.0, side, (int(new.sum()), 2))
        rows = np.array([cell.half_planes for cell in cells])
        targets = goals[:, 0] + 1j * goals[:, 1]
        closest = min(closest, drive(states, rows, targets, np.ones(robots, np.bool_), LIMITS, PERIOD_S / 8, 8))
    return closest, outside


@seeds(5)
def test_stopping_segments_stay_in_their_cells_and_robots_apart(seed: int) -> None:
    for team in range(seed, TEAMS, 5):
        robots = 2 + team * 29 // TEAMS
        closest, outside = worst_of_team(robots, team, UPDATES)
        assert closest >= 2.0 * RADIUS_M - 1e-9
        assert outside <= 1e-9
