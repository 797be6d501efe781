"""200 random fault timelines against the safety invariants.

`python -m benchmarks safety`; TOUCHLINE_RUNS sets the number of timelines (200).
"""

from __future__ import annotations

import os
from collections import Counter

from benchmarks._invariants import Broken, random_run
from touchline.schemas.messages import TraversalStatus


def main() -> None:
    """Print how the timelines ended, and every invariant that was broken."""
    runs = int(os.environ.get("TOUCHLINE_RUNS", "200"))
    ends: Counter[str] = Counter()
    for seed in range(runs):
        run = random_run(seed)
        try:
            state = run.run()
        except Broken as broken:
            ends["broken"] += 1
            print(f"  timeline {seed}: {broken}")
            continue
        ends["done" if state == TraversalStatus.DONE else f"waits for a person: {run.reasons[-1]}"] += 1
    print(f"{runs} random fault timelines, {ends['broken']} with a broken invariant")
    for end, count in ends.most_common():
        print(f"  {count:4d}  {end}")
