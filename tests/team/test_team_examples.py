"""Examples of team algorithms: each does what it is for, in the emulator."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.sparse.csgraph import connected_components
from shapely import Point

from touchline.coordination.algorithms import asking
from touchline.coordination.algorithms.algorithm_loading import algorithm_of
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.plugins import TEAM_ALGORITHMS
from touchline.schemas.team import AlgorithmChoice, TeamScenario

pytestmark = pytest.mark.xdist_group("team")
ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = [path for path in sorted((ROOT / "examples" / "teams").glob("*.py")) if path.stem != "over_zenoh"]
HALF_LOST = {"loss": 0.5}
SWAP = {"kind": "swap"}


@pytest.fixture(autouse=True)
def _never_late(monkeypatch: pytest.MonkeyPatch) -> Any:
    """No answer is late, however busy the machine is."""
    monkeypatch.setattr(asking, "perf_counter", lambda: 0.0)
    yield
    if TEAM_ALGORITHMS.has("ours"):
        TEAM_ALGORITHMS.forget("ours")


class Outcome:
    """Run of an example with eight robots: its figures, its algorithms by robot, and places (k, n) x + iy (m)."""

    def __init__(self, use: str, options: dict[str, Any] | None = None, avoid: str = "plans", **given: Any) -> None:
        make = algorithm_of(AlgorithmChoice(use=str(ROOT / "examples" / "teams" / use), options=options or {}))
        made = []
        TEAM_ALGORITHMS.register("ours", "of this test", lambda: made.append(make()) or made[-1])
        fields = {"algorithm": {"use": "ours"}, "avoid": avoid, "robots": 8} | given
        if "places" in given:
            del fields["robots"]
        self.run = TeamRun(TeamScenario.model_validate(fields))
        self.run.run()
        self.figures = team_figures(self.run, 1.0)
        self.algorithms = made[1:] or made  # the first one only shows of which kind it is
        self.places = np.array(self.run.trace.places) @ (1.0, 1.0j)
        assert not self.figures["algorithm"]["wrong_answers"]
        if avoid != "none":
            assert self.figures["contacts"] == 0, self.figures["reason"]

    @property
    def apart_m(self) -> Any:
        """(k, n, n) distances; infinite of a robot and itself."""
        off_m = np.abs(self.places[:, :, None] - self.places[:, None])
        return off_m + np.where(np.eye(off_m.shape[1], dtype=bool), math.inf, 0.0)


def grid(pitch_m: float, shift_m: float = 0.0) -> list[tuple[float, float]]:
    return [(1.0 + shift_m + pitch_m * (k % 3), 1.0 + shift_m + pitch_m * (k // 3)) for k in range(8)]


def standing(pitch_m: float) -> dict[str, Any]:
    return {f"tb{k + 1}": {"x_m": x, "y_m": y, "heading_rad": 0.0} for k, (x, y) in enumerate(grid(pitch_m))}


def diameter_m(places: Any) -> float:
    return float(np.abs(places[:, None] - places[None]).max())


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_names_its_source_and_is_in_the_guide(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    assert re.search(r"\b(19|20)\d\d\b", text.split('"""')[1])
    assert f"`{path.stem}.py:" in (ROOT / "docs" / "guides" / "team-algorithms.md").read_text(encoding="utf-8")


def test_cyclic_pursuit_meets() -> None:
    around = np.exp(2j * np.pi * np.arange(8) / 8)
    places = {
        f"tb{k + 1}": {"x_m": 3 + 1.6 * at.real, "y_m": 3 + 1.6 * at.imag, "heading_rad": 0}
        for k, at in enumerate(around)
    }
    team = Outcome("cyclic_pursuit.py:CyclicPursuit", {"turn": 0.5}, places=places, duration_s=20.0)
    assert diameter_m(team.places[-1]) < 0.6 * diameter_m(team.places[0])


def test_rendezvous_meets_and_loses_no_neighbour() -> None:
    team = Outcome("rendezvous.py:Rendezvous", places=standing(1.3), radio=HALF_LOST, duration_s=20.0)
    assert diameter_m(team.places[0]) > 3.6
    assert diameter_m(team.places[-1]) < 1.6
    assert team.apart_m[:, team.apart_m[0] < 1.9].max() < 2.0


def test_a_formation_takes_its_shape_where_it_is_to_be() -> None:
    team = Outcome("formation.py:Formation", places=standing(1.1), duration_s=40.0)
    wanted = np.array(list(team.algorithms[0].offsets.values()))
    off = team.places[-1] - wanted
    assert np.abs(off - off.mean()).max() < 0.2
    middle = np.mean(team.run.area.hull, axis=0) @ (1.0, 1.0j)
    assert abs(team.places[-1].mean() - middle) < 0.3


def test_a_flock_aligns_and_stays_together() -> None:
    team = Outcome("flocking.py:Flocking", duration_s=40.0)
    velocities = np.diff(team.places[-26:], axis=0) / 0.4
    assert (np.abs(velocities.mean(axis=1)) / np.abs(velocities).mean(axis=1)).min() > 0.9
    assert 0.1 < np.abs(velocities.mean(axis=1)).mean() < 0.25  # γ: 0.15 m/s, on a somewhat smaller circle
    assert connected_components(team.apart_m[-1] < 1.2 * 0.8)[0] == 1
    assert team.apart_m[-1].min() > 0.55


def test_coverage_learns_what_is_important() -> None:
    disc = {"x_m": 3.3, "y_m": 3.1, "radius_m": 0.9, "value": 10.0}
    task = {"kind": "deploy", "importance": {"discs": [disc]}}
    team = Outcome("learned_coverage.py:LearnedCoverage", task=task, duration_s=60.0)
    cost = team.run.trace.cost
    assert cost[-1] < 0.1 * cost[0]
    for algorithm in team.algorithms:
        truth = [team.run.density.at(*point) for point in algorithm.points.tolist()]
        assert np.corrcoef(algorithm.basis(algorithm.points) @ algorithm.a, truth)[0, 1] > 0.6
        assert algorithm.a.min() > 0.0


def test_an_auction_ends_near_the_shortest_ways_although_messages_are_lost() -> None:
    team = Outcome("auction.py:Auction", radio=HALF_LOST, duration_s=50.0)
    ways_m = np.array([algorithm.ways_m for algorithm in team.algorithms])
    mine = [algorithm.mine for algorithm in team.algorithms]
    assert sorted(mine) == list(range(8))
    assert ways_m[range(8), mine].sum() <= ways_m[linear_sum_assignment(ways_m)].sum() + 8 * 0.1
    goals = [algorithm.places[algorithm.mine] for algorithm in team.algorithms]
    assert np.abs(team.places[-1] - goals).max() < 0.1


def test_robots_of_capt_never_come_nearer_than_two_radii() -> None:
    apart_m = 0.65
    r_m = apart_m / (2.0 * math.sqrt(2.0))
    places = standing(apart_m)
    area = {"outline": [(0, 0), (6, 0), (6, 6), (0, 6)]}
    team = Outcome("capt.py:Capt", avoid="none", places=places, area=area, duration_s=30.0)
    starts, goals = np.array(list(team.algorithms[0].ways.values())).T
    for done in np.linspace(0.0, 1.0, 101):
        at = starts + done * (goals - starts)
        assert np.abs(at[:, None] - at[None])[~np.eye(8, dtype=bool)].min() >= 2.0 * r_m - 1e-3
    assert team.figures["contacts"] == 0
    assert np.abs(team.places[-1] - goals).max() < 0.1


def test_guards_spread_evenly_along_the_outline() -> None:
    team = Outcome("perimeter.py:Perimeter", duration_s=80.0)
    curve = team.algorithms[0].curve
    guards = [Point(place.real, place.imag) for place in team.places[-1]]
    at_m = np.sort([curve.project(guard) for guard in guards])
    gaps_m = np.diff(np.append(at_m, at_m[0] + curve.length))
    assert max(curve.distance(guard) for guard in guards) < 0.15
    assert np.abs(gaps_m * 8 / curve.length - 1.0).max() < 0.25


def test_dispersion_spreads() -> None:
    team = Outcome("dispersion.py:Dispersion", duration_s=40.0)
    assert team.apart_m[0].min(axis=1).max() < 0.5
    assert team.apart_m[-1].min(axis=1).min() > 1.1


def test_all_name_the_same_leader_and_drive_to_it_although_messages_are_lost() -> None:
    team = Outcome("leader_election.py:LeaderElection", {"epoch_s": 15.0}, radio=HALF_LOST, duration_s=44.0)
    (leader,) = {algorithm.leader for algorithm in team.algorithms}
    off_m = team.apart_m[-1, team.run.names.index(leader)]
    assert np.sort(off_m)[:-1].max() < 1.5


def test_robots_that_change_places_by_orca_do_not_touch_without_safety() -> None:
    team = Outcome("orca.py:Orca", avoid="none", task=SWAP, duration_s=60.0)
    assert team.figures["contacts"] == 0
    assert team.figures["goals"]["arrived"] == 8


def test_plans_hardly_change_wishes_of_orca() -> None:
    team = Outcome("orca.py:Orca", task=SWAP, duration_s=60.0)
    assert team.figures["goals"]["arrived"] == 8
    assert team.figures["intervention"]["mean_change_mps"] < 0.01


def test_robots_change_places_by_buffered_voronoi_cells() -> None:
    team = Outcome("bvc.py:Bvc", task=SWAP, duration_s=60.0)
    assert team.figures["goals"]["arrived"] == 8
    assert team.figures["intervention"]["mean_change_mps"] < 0.05


def test_robots_with_a_token_reach_their_goals_on_ways_that_do_not_meet() -> None:
    order = [5, 3, 7, 0, 6, 1, 2, 4]
    goals = {f"tb{k + 1}": [grid(1.6, 0.8)[order[k]]] for k in range(8)}
    area = {"outline": [(0, 0), (6, 0), (6, 6), (0, 6)]}
    team = Outcome(
        "token_planner.py:TokenPlanner",
        places=standing(1.6),
        area=area,
        task={"kind": "goals", "goals": goals},
        radio={"range_m": 4.0, "loss": 0.5},
        duration_s=90.0,
    )
    assert team.figures["goals"]["arrived"] == 8
    assert team.figures["intervention"]["mean_change_mps"] < 0.01
