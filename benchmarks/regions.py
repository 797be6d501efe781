"""Robots in regions: claims, handovers and plans of all regions in one process, on one core, in multiples of real time.

`python -m benchmarks regions`: the robots follow their plans exactly, each to one goal after another anywhere; nothing
is lost, and messages between regions are function calls. `robots` is their number, `columns` that of regions each way,
`seconds` the sim time; with `emulated=1` they are
emulated with noise, slip and motor lag. Times are of the processor, as other work runs beside.
"""

import time

import numpy as np

from benchmarks._region_team import PERIOD_S, RegionTeam
from benchmarks._settings import Small

SMALL = Small(
    {"robots": 40, "seconds": 4.0},
    (
        "40 robots in # regions, # s: # × real time on one core",
        "planning of a region, ms an update: median #, most #",
        "letters between regions #/s, orders #/s, reports #/s; in all # MB/s",
        "handovers #/s; mean speed # m/s; closest centres # m",
    ),
)


def main(robots: int = 1000, columns: int = 2, seconds: float = 60.0, emulated: int = 0) -> None:
    """Print the figures of a run."""
    RegionTeam(4, 2, 2).update()  # compiles, or loads what is compiled
    team = RegionTeam(robots, columns, columns, emulated=bool(emulated))
    updates, begin = round(seconds / PERIOD_S), time.process_time()
    for _ in range(updates):
        team.update()
    spent_s, figures, sim_s = time.process_time() - begin, team.figures, updates * PERIOD_S
    planning_ms = 1e3 * np.array(figures.planning_s)
    rates = {kind: figures.messages[kind] / sim_s for kind in ("letter", "order", "report")}
    size = sum(figures.sizes.values()) / sim_s / 1e6
    handovers = sum(hub.region.handed_over for hub in team.hubs) / sim_s
    mean_mps = figures.driven_m / robots / sim_s
    print(f"{robots} robots in {len(team.hubs)} regions, {sim_s:g} s: {sim_s / spent_s:.2f} × real time on one core")
    print(f"planning of a region, ms an update: median {np.median(planning_ms):.1f}, most {planning_ms.max():.1f}")
    print(f"messages and answers, ms an update of all regions: {1e3 * figures.letters_s / figures.updates:.1f}")
    print(
        f"letters between regions {rates['letter']:.0f}/s, orders {rates['order']:.0f}/s, "
        f"reports {rates['report']:.0f}/s; in all {size:.2f} MB/s"
    )
    print(f"handovers {handovers:.1f}/s; mean speed {mean_mps:.2f} m/s; closest centres {figures.closest_m:.4f} m")
    if emulated:
        share = figures.driving_s / spent_s
        print(f"emulation {100 * share:.0f} % of the time; true closest centres {figures.truly_closest_m:.4f} m")
