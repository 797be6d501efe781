"""Team algorithms of `examples/teams` over lossy radio: contacts, interventions and messages.

`python -m benchmarks team_algorithms`; `seeds` runs of each from seed `first`, teams of `least` to `most` robots,
`only` one algorithm, all for a `share` of their time, with a share of messages lost (`loss`): those between robots and,
by cells, those to and from the coordinator, too, which plans do not allow for yet. `straight` wishes to drive straight
to its goal; the rows by `none` have no safety.

Columns: contacts of two robots and with walls, least distance of plans or stopping segments (m), share of wishes that
were changed, mean change (m/s and rad/s), updates, messages, bytes a message, Jain's index of progress to goals and
robots that have arrived where there are goals, wrong answers, and wall-clock time per run.
"""

import random
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks._settings import Small
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.team import LOSSY_LEASE_S, TeamScenario

EXAMPLES: Final = Path(__file__).resolve().parents[1] / "examples" / "teams"
SIZES: Final = (4, 10, 50)
SMALL = Small(
    {"least": 4, "most": 4, "seeds": 1, "share": 0.02},
    (
        "# seeds from #",
        "cyclic_pursuit 4 plans # # # # # # # # #",
        "orca 4 plans # # # # # # # # # # # of #",
        "straight 4 none # # # # # # # # - # # of #",
    ),
)


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


STRAIGHT: Final = Path(__file__).with_name("_team_wishes.py").resolve()
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


def main(
    least: int = 10,
    most: int = 50,
    seeds: int = 5,
    first: int = 1,
    only: str = "",
    share: float = 1.0,
    loss: float = 0.5,
) -> None:
    """Print a row for each algorithm, size of a team, and way to keep robots apart."""
    print(f"{seeds} seeds from {first}, {loss:.0%} of messages lost")
    print(
        f"{'algorithm':16}  robots  avoid  robots touch  walls  least m  changed  m/s     rad/s   updates  "
        "messages  bytes  Jain   arrived    wrong  s"
    )
    for robots in (robots for robots in SIZES if least <= robots <= most):
        for case in CASES:
            for avoid in case.avoid if only in ("", case.name) else ():
                rows = [_row(case, robots, avoid, seed, share, loss) for seed in range(first, first + seeds)]
                print(f"{case.name:16}  {robots:6}  {avoid:5}  {_line(rows)}", flush=True)


def _line(rows: list[dict[str, float]]) -> str:
    """Return the figures of some runs as text: sums of contacts, the least distance, means of the others."""
    total = {key: sum(row[key] for row in rows) for key in rows[0]}
    mean = {key: each / len(rows) for key, each in total.items()}
    bytes_each = f"{total['bytes'] / total['messages']:5.0f}" if total["messages"] else "    -"
    there = f"{total['arrived']:.0f} of {total['goals']:.0f}"
    goals = f"{mean['jain']:.3f}  {there:10}" if total["goals"] else ""
    return (
        f"{total['touch']:12.0f}  {total['walls']:5.0f}  {min(row['least_m'] for row in rows):7.4f}  "
        f"{mean['changed']:7.3f}  {mean['mps']:.4f}  {mean['radps']:.4f}  {mean['updates']:7.0f}  "
        f"{mean['messages']:8.0f}  {bytes_each}  {goals:17}  {total['wrong']:5.0f}  {mean['wall_s']:4.1f}"
    )


def _row(case: Case, robots: int, avoid: str, seed: int, share: float, loss: float) -> dict[str, float]:
    """Return the figures of a run."""
    given, base = case.given(robots, seed), TeamScenario()
    options, range_m = given.pop("options", {}), given.pop("range_m", 2.0)
    lossy = base.onboard.team.model_copy(update={"lease_s": LOSSY_LEASE_S})
    with_cells = {"links": {"loss": loss}, "onboard": base.onboard.model_copy(update={"team": lossy}).model_dump()}
    team = TeamScenario.model_validate(
        {
            "algorithm": {"use": case.use, "options": options},
            "avoid": avoid,
            "world": base.world.model_copy(update={"seed": seed}).model_dump(),
            "radio": {"loss": loss, "range_m": range_m},
            "duration_s": share * case.duration_s,
            **(with_cells if avoid == "cells" and loss else {}),
            **given,
        }
    )
    begun_s, run = perf_counter(), TeamRun(team)
    run.run()
    figures = team_figures(run, 1.0)
    radio = figures["algorithm"].get("radio", {"sent": 0, "sent_bytes": 0})
    wrong = figures["algorithm"]["wrong_answers"].values()
    progress = _progress(run)
    return {
        "touch": figures["contacts"] - figures["contacts_with_walls"],
        "walls": figures["contacts_with_walls"],
        "least_m": figures["believed"]["nearest_segments_m" if avoid == "cells" else "nearest_plans_m"],
        "changed": figures["intervention"]["changed_share"],
        "mps": figures["intervention"]["mean_change_mps"],
        "radps": figures["intervention"]["mean_change_radps"],
        "updates": figures["intervention"]["wishes"] / robots,
        "messages": radio["sent"],
        "bytes": radio["sent_bytes"],
        "jain": float(progress.sum() ** 2 / (robots * (progress**2).sum())) if progress.any() else 0.0,
        "goals": len(progress),
        "arrived": int(run.arrived.sum()) if len(progress) else 0,
        "wrong": sum(count for each in wrong for code, count in each.items() if code != "first"),
        "wall_s": perf_counter() - begun_s,
    }


def _progress(run: TeamRun) -> NDArray[np.float64]:
    """Return the share of its way to its goal that each robot has come nearer to it; empty without goals."""
    goals = run.task.last
    starts = np.array([(run.starts[name].x_m, run.starts[name].y_m) for name in run.names if name in goals])
    ends = np.array([place for name, place in zip(run.names, run.places(), strict=True) if name in goals])
    if not goals:
        return np.zeros(0)
    wanted = np.array([goals[name] for name in run.names if name in goals])
    found: NDArray[np.float64] = 1.0 - np.hypot(*(ends - wanted).T) / np.hypot(*(starts - wanted).T)
    return np.clip(found, 0.0, 1.0)
