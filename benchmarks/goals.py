"""Drives to random goals, some replaced under way, and their true accuracy.

`python -m benchmarks goals`; `runs` is the number of drives of each robot, in chains of `chain`.
"""

import math
import time
from collections import Counter

import numpy as np

from benchmarks._goal_chain import GoalChain
from benchmarks._settings import Small
from touchline.jobs.goal.arrival import NEAR_M, NEAR_RAD

REPORT_EVERY = 100
DRIVERS = (("turtlebot3-waffle-pi", "mpc"), ("turtlebot2", "mpc"), ("turf-tank-two", "mpc"))
SMALL = Small(
    {"runs": 1, "chain": 2},
    (
        *(f"{name} by {follower}, default noise, # drives, # goals under way:" for name, follower in DRIVERS),
        "arrived #, within # cm and # degrees #",
        "off, mm: median #, p95 #, from # to #",
        "turned as it believes, deg: median #, p95 #, from # to #",
        "largest jump of the reference: # mm, # degrees, # mm/s",
        "fastest wheel: planned # of its most, at any millisecond, commanded #",
    ),
)


def main(runs: int = 1000, chain: int = 25) -> None:
    """Drive all robots, and print the figures."""
    for name, follower in DRIVERS:
        _drive(name, follower, runs, chain)


def _drive(name: str, follower: str, runs: int, count: int) -> None:
    rng, begun = np.random.default_rng(17), time.perf_counter()
    chains: list[GoalChain] = []
    for done in range(count, runs + count, count):
        chain = GoalChain(name, follower, rng)
        for _ in range(count):
            chain.drive(others=int(rng.integers(0, 3)))
        chains.append(chain)
        if done % REPORT_EVERY == 0:
            print(f"  {done} of {runs} after {time.perf_counter() - begun:.0f} s", flush=True)
    _print(chains, count * len(chains))


def _print(chains: list[GoalChain], drives: int) -> None:
    first = chains[0]
    ends = np.array([end for chain in chains for end in chain.ends])
    believed = np.array([end for chain in chains for end in chain.believed])
    largest = np.array([jump for chain in chains for jump in chain.jumps]).max(axis=0)
    near = (ends[:, 0] <= NEAR_M) & (ends[:, 1] <= NEAR_RAD)
    taken = sum(chain.taken for chain in chains)
    print(f"{first.vehicle_name} by {first.follower}, {first.noise} noise, {drives} drives, {taken} goals under way:")
    print(f"  arrived {len(ends)}, within 2 cm and 2 degrees {int(near.sum())}")
    for label, figures, scale in (
        ("off, mm", ends[:, 0], 1e3),
        ("off as it believes, mm", believed[:, 0], 1e3),
        ("turned, deg", ends[:, 1], math.degrees(1.0)),
        ("turned as it believes, deg", believed[:, 1], math.degrees(1.0)),
        ("late, s", ends[:, 2], 1.0),
    ):
        low, middle, high = scale * np.percentile(figures, (0, 50, 95))
        print(f"  {label}: median {middle:.2f}, p95 {high:.2f}, from {low:.2f} to {scale * figures.max():.2f}")
    print(
        f"  largest jump of the reference: {1e3 * largest[0]:.2f} mm, {math.degrees(largest[1]):.3f} degrees, "
        f"{1e3 * largest[2]:.2f} mm/s"
    )
    planned, commanded = max(c.wheel_share for c in chains), max(c.commanded_share for c in chains)
    print(f"  fastest wheel: planned {planned:.9f} of its most, at any millisecond, commanded {commanded:.9f}")
    for reason, times in Counter(reason for chain in chains for reason in chain.refused).most_common(8):
        print(f"  not taken {times} times: {reason}")
