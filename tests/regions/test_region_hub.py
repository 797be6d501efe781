"""Robots in four regions: handed over at the borders, and never nearer than their plans may be."""

import pytest

from benchmarks._region_team import LIMITS, RegionTeam


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.full) for seed in range(2, 8))])
def test_robots_of_four_regions_never_meet(seed: int) -> None:
    team = RegionTeam(40, 2, 2, seed)
    for _ in range(100):
        team.update()
    assert team.figures.closest_m >= LIMITS.apart_m - 1e-9
    assert sum(hub.region.handed_over for hub in team.hubs) > 20
    assert team.figures.driven_m > 100.0
    owned = [name for hub in team.hubs for name in hub.region.own]
    assert sorted(owned) == sorted(team.robots)
