"""Ways to goals among obstacles: proofs against ways, lengths against a denser search, the narrowest place, times.

`python -m benchmarks routes`: `worlds` of 16 x 16 m (rooms with doors of 0.70 to 1.40 m, clutter, U-shaped traps) with
`goals` each, and `passages` that are too narrow by 1 to 20 cm. Times are seconds of the processor. With `peer_s=5` and
OMPL (`pip install './research[peers]'`) its BIT* searches for that long for each way, too.
"""

import math
import time
from collections import Counter

import numpy as np
import shapely

from benchmarks._settings import NotHereError, Small
from touchline.schemas.errors import PlanningError
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.free_space.convex_parts import body_parts
from touchline.services.planner.free_space.ground_ways import GroundWays
from touchline.services.planner.free_space.narrowest import narrowest_place
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.reachability import Reachability
from touchline.services.planner.free_space.roadmap import Roadmap
from touchline.services.planner.free_space.slices import Slicer
from touchline.services.planner.geometry.clothoid import PathPose
from touchline_research.obstacles.free_worlds import box, random_pose, world
from touchline_research.obstacles.ompl_search import INSTALL, OmplProcess, has_ompl
from touchline_research.obstacles.ways_to_goals import RADIUS_M

OUTLINE = Vehicle().body.footprint_m
# Ways with more straights have no bound of their length.
MANOEUVRES = 20
SMALL = Small(
    {"worlds": 3, "goals": 2, "passages": 1},
    (
        "# goals in # worlds: # with a way, # without, # undecided",
        "reached # of #; contradictions #",
        "length by the denser map's: mean #, p95 #, worst #",
        "s: map p50 #, p95 #; query p50 #, p95 #, worst #; proofs of a world p50 #, p95 #",
        "too narrow by, error in mm: worst # of # passages",
    ),
)


def main(worlds: int = 100, goals: int = 10, passages: int = 50, peer_s: float = 0.0) -> None:
    """Decide and plan for all goals, and print the figures."""
    if peer_s and not has_ompl():
        raise NotHereError(INSTALL)
    peers: list[tuple[float, float | None]] = []
    proofs, outcomes, ratios = Counter[str](), Counter[str](), list[float]()
    maps_s, queries_s, proofs_s = list[float](), list[float](), list[float]()
    for seed in range(worlds):
        ground, rng = world(seed), np.random.default_rng(seed + 1000)
        begun = time.process_time()
        ways = GroundWays(ground, OUTLINE, 0.0)
        assert ways.roadmap is not None
        maps_s.append(time.process_time() - begun)
        dense = _denser(ground)
        reachability = Reachability(Slicer(ground, body_parts(OUTLINE, 0.0)))
        start, spent_s = random_pose(rng, ground, OUTLINE), 0.0
        for _ in range(goals):
            goal = random_pose(rng, ground, OUTLINE)
            begun = time.process_time()
            proof = reachability.prove(start, goal).value
            proved = time.process_time()
            spent_s += proved - begun
            proofs[proof] += 1
            try:
                legs = ways.legs(start, goal)
                queries_s.append(time.process_time() - proved)
            except PlanningError:
                outcomes[f"none, {proof}"] += 1
                continue
            outcomes[f"reached, {proof}"] += 1
            if legs.manoeuvres <= MANOEUVRES:
                ratios.append(legs.length_m / min(legs.length_m, dense.legs(start, goal).length_m))
                if peer_s:
                    with OmplProcess() as ompl:
                        way = ompl.way(ways.body, RADIUS_M, "BITstar", (start, goal), peer_s)
                    peers.append((legs.length_m, way.length_m if way else None))
        proofs_s.append(spent_s)
    exists, none = proofs["exists"], proofs["none"]
    print(f"{sum(proofs.values())} goals in {worlds} worlds: {exists} with a way, {none} without,", end=" ")
    print(f"{proofs['undecided']} undecided")
    print(f"reached {outcomes['reached, exists']} of {exists}; contradictions {outcomes['reached, none']}")
    print(f"length by the denser map's: mean {np.mean(ratios):.4f}, p95 {np.percentile(ratios, 95):.4f},", end=" ")
    print(f"worst {max(ratios):.3f}")
    _print_peer(peers)
    times = [np.percentile(each, (50, 95)) for each in (maps_s, queries_s, proofs_s)]
    print(f"s: map p50 {times[0][0]:.2f}, p95 {times[0][1]:.2f}; query p50 {times[1][0]:.3f}, p95", end=" ")
    print(
        f"{times[1][1]:.3f}, worst {max(queries_s):.2f}; proofs of a world p50 {times[2][0]:.2f}, p95 {times[2][1]:.2f}"
    )
    errors = [_passage(seed) for seed in range(passages)]
    print(f"too narrow by, error in mm: worst {1e3 * max(errors):.1f} of {passages} passages")


def _print_peer(lengths: list[tuple[float, float | None]]) -> None:
    """Print lengths of ways by a peer, as multiples of ours."""
    found = [theirs / ours for ours, theirs in lengths if theirs]
    if found:
        print(f"BIT* found {len(found)} of {len(lengths)}; length by ours: mean {np.mean(found):.3f},", end=" ")
        print(f"least {min(found):.3f}, p95 {np.percentile(found, 95):.3f}")


def _denser(ground: ObstructedGround) -> GroundWays:
    """Ways by a map with more places and more straights from each."""
    ways = GroundWays(ground, OUTLINE, 0.0)
    ways.roadmap = Roadmap(ways.body, finer=3)
    return ways


def _passage(seed: int) -> float:
    """Error (m) of how much a slanting passage is too narrow."""
    rng = np.random.default_rng(seed)
    short, turn, length = rng.uniform(0.01, 0.2), rng.uniform(0.0, math.tau), rng.uniform(1.2, 3.0)
    width = 0.83 - short  # the body is 0.83 m wide
    walls = [box(0.0, sign * (width / 2 + 10.0), length, 20.0, 0.0) for sign in (1, -1)]
    turned = [shapely.affinity.rotate(wall, turn, origin=(0, 0), use_radians=True) for wall in walls]
    ground = ObstructedGround.of(shapely.box(-7.0, -7.0, 7.0, 7.0), turned)
    ends = [PathPose(d * 3.5 * math.cos(turn), d * 3.5 * math.sin(turn), turn + 0.4) for d in (-1, 1)]
    found = narrowest_place(ground, OUTLINE, 0.0, *ends)
    assert found is not None
    return abs(found.too_narrow_m - short)
