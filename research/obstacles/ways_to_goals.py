"""Ways to goals in random worlds, by the product's planner and by OMPL, on goals that are proved to be reachable."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
import shapely

from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround, KnownObstacle
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.free_space.convex_parts import body_parts
from touchline.services.planner.free_space.ground_ways import GroundWays
from touchline.services.planner.free_space.legs import WalledBody
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.reachability import Proof, Reachability
from touchline.services.planner.free_space.slices import Slicer
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.goal_plan import plan_to_goal
from touchline_research.obstacles.free_worlds import SIZE_M, random_pose, world
from touchline_research.obstacles.ompl_search import INSTALL, STEP_M, FoundWay, OmplProcess, has_ompl
from touchline_research.target_table import TargetRow, TargetTable, against_targets

Progress = Callable[[str, float], None]

MARKER: Final = Vehicle()
OUTLINE: Final = MARKER.body.footprint_m
RADIUS_M: Final = 1.0 / MARKER.drive.default_kappa_max_1pm
NEVER_SPINS: Final = MARKER.model_copy(update={"drive": MARKER.drive.model_copy(update={"can_spin": False})})
"""The marker as a car."""
OURS: Final = "ours: straights and turns on the spot"
OURS_AS_CAR: Final = "the product's search for cars"
RRT: Final = "OMPL: RRT-Connect"
MANOEUVRES: Final = 20
"""Ways of ours with more straights have no bound of their length."""
SAME: Final = 1e-3
"""Relative difference up to which two lengths are the same."""


def bit_star(seconds: float) -> str:
    """Name of OMPL's BIT* that searches for a time [s]."""
    return f"OMPL: BIT*, {seconds:g} s"


class Trial(NamedTuple):
    """A goal that is proved to be reachable, and the ways to it.

    Attributes:
        seed: Seed of the world.
        start: Start.
        goal: Goal.
        manoeuvres: Number of straights of ours; 0 if it has none.
        ways: Way of each planner; None if it found none.
    """

    seed: int
    start: PathPose
    goal: PathPose
    manoeuvres: int
    ways: dict[str, FoundWay | None]


def try_ways(worlds: int, goals: int, searches_s: Sequence[float], progress: Progress) -> list[Trial]:
    """Let all planners find ways to goals in random worlds.

    Args:
        worlds: Number of worlds.
        goals: Number of goals in each; those that are not proved to be reachable are left out.
        searches_s: Times for BIT*.
        progress: Called with the current measurement and the fraction of it that is done.
    """
    found: list[Trial] = []
    for seed in range(worlds):
        progress(f"ways in world {seed} of {worlds}", seed / worlds)
        ground, rng = world(seed), np.random.default_rng(seed + 1000)
        ways = GroundWays(ground, OUTLINE, 0.0)
        proofs = Reachability(Slicer(ground, body_parts(OUTLINE, 0.0)))
        start = random_pose(rng, ground, OUTLINE)
        # The map is made once for a ground, and does not count; for the search for cars it is kept, too.
        _ways_of_ours(ways, start, start)
        for _ in range(goals):
            goal = random_pose(rng, ground, OUTLINE)
            if proofs.prove(start, goal) is not Proof.EXISTS:
                continue
            manoeuvres, ours = _ways_of_ours(ways, start, goal)
            by_planner = {OURS: ours, OURS_AS_CAR: _way_of_car(ground, start, goal)}
            if has_ompl():
                by_planner |= _ways_of_peer(ways.body, (start, goal), searches_s)
            found.append(Trial(seed, start, goal, manoeuvres, by_planner))
    return found


def _ways_of_peer(
    body: WalledBody, ends: tuple[PathPose, PathPose], searches_s: Sequence[float]
) -> dict[str, FoundWay | None]:
    with OmplProcess() as ompl:
        found = {RRT: ompl.way(body, RADIUS_M, "RRTConnect", ends, max(searches_s))}
        for seconds in searches_s:
            found[bit_star(seconds)] = ompl.way(body, RADIUS_M, "BITstar", ends, seconds)
    return found


def _ways_of_ours(ways: GroundWays, start: PathPose, goal: PathPose) -> tuple[int, FoundWay | None]:
    begun = time.process_time()
    try:
        legs = ways.legs(start, goal)
    except PlanningError:
        return 0, None
    return legs.manoeuvres, FoundWay(legs.length_m, time.process_time() - begun, legs.places[:, :2])


def _way_of_car(ground: ObstructedGround, start: PathPose, goal: PathPose) -> FoundWay | None:
    """Way of the marker if it could not turn on the spot: with continuous curvature, of OMPL's radius at least."""
    square = shapely.box(0.0, 0.0, SIZE_M, SIZE_M)
    parts = [each for each in shapely.get_parts(shapely.difference(square, ground.free)) if each.area > 0.0]
    obstacles = tuple(
        KnownObstacle(
            id=f"o{number}",
            corners=tuple(part.exterior.coords[:-1]),
            holes=tuple(tuple(ring.coords[:-1]) for ring in part.interiors),
        )
        for number, part in enumerate(parts)
    )
    known = KnownGround(boundary=tuple(square.exterior.coords[:-1]), obstacles=obstacles)
    aim = PoseGoal(x_m=goal.x_m, y_m=goal.y_m, heading_rad=goal.heading_rad)
    options = PlanOptions(start=list(start), kappa_max_1pm=1.0 / RADIUS_M, margin_m=0.0)
    begun = time.process_time()
    try:
        plan = plan_to_goal(aim, NEVER_SPINS, options, ground=known)
    except PlanningError:
        return None
    path = plan.sections[0].path
    x, y = path.sample(np.arange(0.0, path.length_m, STEP_M))[:2]
    return FoundWay(path.length_m, time.process_time() - begun, np.column_stack((x, y)))


def ways_table(trials: Sequence[Trial], searches_s: Sequence[float]) -> TargetTable:
    """Return the table of ways.

    Args:
        trials: The goals.
        searches_s: Times for BIT*, as in `try_ways`.
    """
    note = (
        "Worlds of 16 m: rooms with doors of 0.70 to 1.40 m, clutter, U-shaped traps; the goals that are proved to be "
        f"reachable. The marker drives straights and turns on the spot; lengths do not count turns. OMPL drives a car "
        f"of radius {RADIUS_M:.2f} m (Reeds-Shepp) with the same body among the same walls, and simplifies its ways; "
        "so does the product's search for cars, with continuous curvature. Its maps, made once for a world, do not "
        "count."
    )
    planners = list(trials[0].ways)
    rows = tuple(_row(planner, trials, bit_star(max(searches_s))) for planner in planners)
    columns = ("planner", "found", "length / ours: all together; p50, p95", "shorter than ours", "time: p50, p95")
    title = f"Ways to {len(trials)} goals in {len({each.seed for each in trials})} worlds"
    return TargetTable(title, columns, rows, note if has_ompl() else f"{note} {INSTALL}")


def _row(planner: str, trials: Sequence[Trial], longest: str) -> TargetRow:
    found = [way for each in trials if (way := each.ways[planner])]
    pairs = [
        (way.length_m, ours.length_m) for each in trials if (way := each.ways[planner]) and (ours := each.ways[OURS])
    ]
    grazing = sum(not way.free for way in found)
    figures: dict[str, float] = {"found": len(found), "goals": len(trials), "grazing": grazing}
    texts = ["", "", ""]
    if pairs:
        lengths = np.array(pairs)
        ratios = lengths[:, 0] / lengths[:, 1]
        together = float(lengths[:, 0].sum() / lengths[:, 1].sum())
        median, p95 = np.percentile(ratios, (50, 95)).tolist()
        shorter = int((ratios < 1.0 - SAME).sum())
        p50_s, p95_s = np.percentile([way.seconds for way in found], (50, 95)).tolist()
        figures |= {"together": together, "median": median, "p95": p95, "shorter": shorter}
        figures |= {"p50_s": p50_s, "p95_s": p95_s}
        texts = [f"{together:.2f}; {median:.2f}, {p95:.2f}", str(shorter), f"{p50_s:.3f}, {p95_s:.3f} s"]
    asked = []
    if planner == OURS:
        asked.append(("all found", len(found) == len(trials)))
        if longest in trials[0].ways:
            worse = sum(_longer(each, longest) for each in trials)
            figures["longer_than_bit_star"] = worse
            asked.append((f"none longer than {longest}, up to {MANOEUVRES} straights", worse == 0))
    count = f"{len(found)} of {len(trials)}" + (f", {grazing} graze walls" if grazing else "")
    return TargetRow((planner, count, *texts), *against_targets(asked), figures)


def _longer(trial: Trial, peer: str) -> bool:
    """True if a way of ours that has a bound on its length is longer than a peer's."""
    ours, theirs = trial.ways[OURS], trial.ways[peer]
    if ours is None or theirs is None or trial.manoeuvres > MANOEUVRES:
        return False
    return ours.length_m > theirs.length_m * (1.0 + SAME)
