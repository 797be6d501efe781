"""Planning times of paths to poses; `touchline study tracking` has the times of driving them.

`python -m benchmarks poses`; `goals` are planned to.
"""

import time

import numpy as np

from benchmarks._settings import Small
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline_research.tracking.studied_robot import ORIGIN, WAFFLE, goals_anywhere

SMALL = Small({"goals": 20}, ("a cubic path: median # ms, # % # ms;", "by g2 instead # ms, for #%"))


def main(goals: int = 1000) -> None:
    """Run the benchmark, and print its figures."""
    took = []
    for goal in goals_anywhere(goals):
        begin = time.perf_counter()
        found = CubicPath().between(ORIGIN, goal, WAFFLE)
        took.append((time.perf_counter() - begin, bool(found.progress)))
    curves = [1e3 * seconds for seconds, cubic in took if cubic]
    falls = [1e3 * seconds for seconds, cubic in took if not cubic]
    print(f"a cubic path: median {np.median(curves):.2f} ms, 95 % {np.percentile(curves, 95):.2f} ms;")
    instead = f"{np.median(falls):.2f} ms, for {len(falls) / len(took):.0%}" if falls else "never"
    print(f"  by g2 instead {instead}")
