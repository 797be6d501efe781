"""Algorithms of `examples/teams` and what each is run on, for benchmarks."""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.schemas.team import LOSSY_LEASE_S, TeamLinks, TeamScenario

EXAMPLES: Final = Path(__file__).resolve().parents[1] / "examples" / "teams"


class Case(NamedTuple):
    """An algorithm and what it is run on: the fields of a team of a number of robots, by seed."""

    name: str
    use: str
    duration_s: float
    given: Callable[[int, int], dict[str, Any]]
    avoid: tuple[str, ...] = ("plans", "cells")


def _corner(robots: int, seed: int) -> dict[str, Any]:
    """Start close together in a corner."""
    return {"robots": robots}


def _auction(robots: int, seed: int) -> dict[str, Any]:
    return {"robots": robots, "options": {"least_mm": 8 * robots}}


def _swap(robots: int, seed: int) -> dict[str, Any]:
    return {"robots": robots, "task": {"kind": "swap"}}


def _important(robots: int, seed: int) -> dict[str, Any]:
    """Start in a corner; a disc elsewhere is important."""
    side_m = (2.5 * robots) ** 0.5
    disc = {"x_m": 0.7 * side_m, "y_m": 0.7 * side_m, "radius_m": 0.2 * side_m, "value": 10.0}
    return {"robots": robots, "task": {"kind": "deploy", "importance": {"discs": [disc]}}}


def _spread(robots: int, seed: int, pitch_m: float = 1.3) -> dict[str, Any]:
    """Start spread over a grid, in any order."""
    columns = int(np.ceil(np.sqrt(robots)))
    grid = [(1.0 + pitch_m * (k % columns), 1.0 + pitch_m * (k // columns)) for k in range(robots)]
    random.Random(seed).shuffle(grid)
    side_m = 2.0 + pitch_m * (columns - 1)
    places = {f"tb{k + 1}": {"x_m": x, "y_m": y, "heading_rad": 0.0} for k, (x, y) in enumerate(grid)}
    return {"places": places, "area": {"outline": [(0, 0), (side_m, 0), (side_m, side_m), (0, side_m)]}}


def _goals(robots: int, seed: int) -> dict[str, Any]:
    """Start spread over a grid, with goals between the starts."""
    pitch_m = 1.6
    given, order = _spread(robots, seed, pitch_m), _spread(robots, seed + 1, pitch_m)["places"]
    goals = {name: [(at["x_m"] + pitch_m / 2, at["y_m"] + pitch_m / 2)] for name, at in order.items()}
    side_m = given["area"]["outline"][2][0] + pitch_m / 2
    area = {"outline": [(0, 0), (side_m, 0), (side_m, side_m), (0, side_m)]}
    return given | {"task": {"kind": "goals", "goals": goals}, "area": area, "range_m": 4.0}


def _example(name: str, kind: str, duration_s: float, given: Callable[[int, int], dict[str, Any]]) -> Case:
    return Case(name, f"{EXAMPLES / name}.py:{kind}", duration_s, given)


CASES: Final = (
    _example("cyclic_pursuit", "CyclicPursuit", 60.0, _spread),
    _example("rendezvous", "Rendezvous", 60.0, _spread),
    _example("formation", "Formation", 60.0, _spread),
    _example("flocking", "Flocking", 60.0, _corner),
    _example("learned_coverage", "LearnedCoverage", 80.0, _important),
    _example("auction", "Auction", 120.0, _auction),
    _example("capt", "Capt", 60.0, _spread),
    _example("perimeter", "Perimeter", 120.0, _corner),
    _example("dispersion", "Dispersion", 60.0, _corner),
    _example("leader_election", "LeaderElection", 60.0, _corner),
    _example("orca", "Orca", 120.0, _swap),
    _example("bvc", "Bvc", 120.0, _swap),
    _example("token_planner", "TokenPlanner", 120.0, _goals),
    Case(
        "straight",
        f"{Path(__file__).with_name('_team_wishes.py').resolve()}:Straight",
        60.0,
        _swap,
        ("none", "plans", "cells"),
    ),
    Case("orca", f"{EXAMPLES / 'orca'}.py:Orca", 120.0, _swap, ("none",)),
    Case("bvc", f"{EXAMPLES / 'bvc'}.py:Bvc", 120.0, _swap, ("none",)),
)


def team_of(
    case: Case,
    robots: int,
    avoid: str,
    seed: int,
    share: float,
    loss: float,
    *,
    links: float = 0.0,
    delay_s: float = 0.0,
) -> TeamScenario:
    """Return the team of a case.

    Args:
        case: The case.
        robots: Number of robots.
        avoid: What keeps them apart.
        seed: Seed of the run.
        share: Share of the case's time.
        loss: Share of the messages between robots that are lost.
        links: Share of those to and from the coordinator that are lost.
        delay_s: Longest delay of the latter.
    """
    given, base = case.given(robots, seed), TeamScenario()
    options, range_m = given.pop("options", {}), given.pop("range_m", 2.0)
    lossy = base.onboard.team.model_copy(update={"lease_s": LOSSY_LEASE_S})
    onboard = base.onboard.model_copy(update={"team": lossy}) if links else base.onboard
    return TeamScenario.model_validate(
        {
            "algorithm": {"use": case.use, "options": options},
            "avoid": avoid,
            "world": base.world.model_copy(update={"seed": seed}).model_dump(),
            "radio": {"loss": loss, "range_m": range_m},
            "duration_s": share * case.duration_s,
            "links": TeamLinks(loss=links, delay_s=delay_s).model_dump(),
            "onboard": onboard.model_dump(),
            **given,
        }
    )
