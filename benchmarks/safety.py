"""Random fault timelines against the safety invariants.

`python -m benchmarks safety`; `runs` is the number of timelines.
"""

from __future__ import annotations

from collections import Counter

from benchmarks._invariants import Broken, random_run
from benchmarks._settings import Small
from touchline.schemas.messages import TraversalStatus

SMALL = Small({"runs": 1}, ("# random fault timelines, 0 with a broken invariant", "# done"))


def main(runs: int = 200) -> None:
    """Print how the timelines ended, and every invariant that was broken."""
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
