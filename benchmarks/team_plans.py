"""Teams that change places, by cells and by committed plans: times against straight ways, contacts, least distances.

`python -m benchmarks team_plans`; `seeds` runs of each size from `least` to `most`, `first` the first seed.

The bound is a straight way at full speed and a second to speed up and brake; turning at the start is not in it.
"""

import math

import numpy as np

from benchmarks._settings import Small
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.team import TeamScenario

ROBOTS = (4, 8, 12, 20, 50)
SMALL = Small(
    {"most": 4, "seeds": 1},
    (
        "teams that change places, # seeds from #",
        "robots by × bound, median worst ≤ 1.5 arrived contacts closest m",
        *(f"4 {avoid} # # # of # # # #" for avoid in ("cells", "plans")),
    ),
)
DURATION_S = 200.0


def main(least: int = 4, most: int = 50, seeds: int = 20, first: int = 101) -> None:
    """Print a row for each size of a team and each way to keep it apart."""
    print(f"teams that change places, {seeds} seeds from {first}")
    print(f"{'robots':>6}  {'by':6}  {'× bound, median':>15}  {'worst':>5}  ≤ 1.5  arrived  contacts  closest m")
    for robots in (robots for robots in ROBOTS if least <= robots <= most):
        for avoid in ("cells", "plans"):
            rows = np.array([_row(robots, avoid, seed) for seed in range(first, first + seeds)])
            factors, arrived, contacts, closest_m = rows.T
            shares = f"{(factors <= 1.5).sum():2} of {seeds:2}"
            print(
                f"{robots:6}  {avoid:6}  {np.median(factors):15.2f}  {factors.max():5.2f}  {shares}  "
                f"{arrived.min():4.0f}  {contacts.sum():8.0f}  {closest_m.min():9.3f}",
                flush=True,
            )


def _row(robots: int, avoid: str, seed: int) -> tuple[float, float, float, float]:
    """Time × bound, robots that have arrived, contacts and least distance of centres (m) of a run."""
    world = TeamScenario().world.model_copy(update={"seed": seed}).model_dump()
    given = {"robots": robots, "task": {"kind": "swap"}, "avoid": avoid, "world": world, "duration_s": DURATION_S}
    team = TeamScenario.model_validate(given)
    run = TeamRun(team)
    starts = np.array([(start.x_m, start.y_m) for start in run.starts.values()])
    ways_m = 2.0 * np.hypot(*(starts - starts.mean(axis=0)).T)
    bound_s = float(ways_m.max()) / team.vehicle.drive.transit_speed_mps + 1.0
    run.run()
    figures = team_figures(run, 1.0)
    after_s = figures["goals"]["all_arrived_s"]
    factor = math.inf if after_s is None else after_s / bound_s
    return factor, figures["goals"]["arrived"], figures["contacts"], figures["closest_m"]
