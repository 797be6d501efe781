"""Team algorithms of `examples/teams` over lossy radio: contacts, interventions and messages.

`python -m benchmarks team_algorithms`; `seeds` runs of each from seed `first`, teams of `least` to `most` robots,
`only` one algorithm, all for a `share` of their time, with a share of messages lost (`loss`): those between robots and,
by cells, those to and from the coordinator, too, which `team_faults` loses by plans as well. `straight` wishes to drive
straight to its goal; the rows by `none` have no safety.

Columns: contacts of two robots and with walls, least distance of plans or stopping segments (m), share of wishes that
were changed, mean change (m/s and rad/s), updates, messages, bytes a message, Jain's index of progress to goals and
robots that have arrived where there are goals, wrong answers, and wall-clock time per run.
"""

from time import perf_counter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from benchmarks._settings import Small
from benchmarks._team_cases import CASES, Case, team_of
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun

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
    team = team_of(case, robots, avoid, seed, share, loss, links=loss if avoid == "cells" else 0.0)
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
