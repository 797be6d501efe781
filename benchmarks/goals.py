"""Random goals, others on the way, and how near the robots come: 1,000 for each robot and follower."""

import math
import time
from collections import Counter

import numpy as np

from benchmarks._goal_chain import GoalChain

COUNT, CHAIN = 1000, 25
DRIVERS = (("turtlebot3-waffle-pi", "pure-pursuit"), ("turtlebot3-waffle-pi", "mpc"), ("turf-tank-two", "mpc"))
NEAR_M, NEAR_RAD = 0.02, math.radians(2.0)


def main() -> None:
    """Print all figures."""
    for name, follower in DRIVERS:
        _drive(name, follower)


def _drive(name: str, follower: str) -> None:
    rng, begun = np.random.default_rng(17), time.perf_counter()
    chains = []
    for _ in range(COUNT // CHAIN):
        chain = GoalChain(name, follower, rng)
        for _ in range(CHAIN):
            chain.drive(others=int(rng.integers(0, 3)))
        chains.append(chain)
    ends = np.array([end for chain in chains for end in chain.ends])
    jumps = np.array([jump for chain in chains for jump in chain.jumps])
    near = (ends[:, 0] <= NEAR_M) & (ends[:, 1] <= NEAR_RAD)
    taken = sum(chain.taken for chain in chains)
    print(f"{name} by {follower}, no noise, {COUNT} drives, {taken} goals taken over under way:")
    print(f"  arrived {len(ends)}, within 2 cm and 2 degrees {int(near.sum())}")
    for label, column, scale in (("off, cm", 0, 100.0), ("turned, deg", 1, math.degrees(1.0)), ("late, s", 2, 1.0)):
        low, middle, high = scale * np.percentile(ends[:, column], (0, 50, 95))
        print(f"  {label}: median {middle:.2f}, p95 {high:.2f}, from {low:.2f} to {scale * ends[:, column].max():.2f}")
    largest = jumps.max(axis=0)
    print(
        f"  largest jump of the reference: {1e3 * largest[0]:.2f} mm, {math.degrees(largest[1]):.3f} degrees, "
        f"{1e3 * largest[2]:.2f} mm/s"
    )
    print(f"  fastest wheel at any planned millisecond: {100.0 * max(c.wheel_share for c in chains):.2f} % of its most")
    for reason, times in Counter(reason for chain in chains for reason in chain.refused).most_common(8):
        print(f"  not taken {times} times: {reason}")
    print(f"  in {time.perf_counter() - begun:.0f} s")
