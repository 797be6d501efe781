"""Wet-aware tour: keeps wheels off wet paint where that is worth the time, by simulated annealing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchline.core.arcs import LENGTH
from touchline.services.planner.budget import UNWATCHED, Budget
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose
from touchline.services.planner.sequencing.annealing import Incumbents, anneal
from touchline.services.planner.sequencing.costs import QuickestTransitions
from touchline.services.planner.sequencing.order import Problem
from touchline.services.planner.sequencing.search import Kicks
from touchline.services.planner.sequencing.tour_evaluation import (
    STEP_M,
    UNKNOWN,
    CrossingCache,
    Scene,
    TourEvaluation,
    all_painted,
    evaluate,
)
from touchline.services.planner.sequencing.wet_paint import BEGUN, NO_LINES, SPEED, WetLines, Wheels, boxes_of, wet_rows
from touchline.services.planner.swaths.swaths import Swath

# Budget: moves per segment, within bounds, for each of the initial temperatures (s), each time from the best order so
# far. With many segments, high temperatures would not return to it within the moves.
MOVES_PER_SEGMENT, MOVES_MIN, MOVES_MAX = 4000, 20_000, 120_000
HEATS_S, HEATS_MANY_S, MANY = (4.0, 2.0, 1.0, 4.0, 2.0, 1.0), (0.6, 0.3), 150
# Where many lines are crossed a move takes long: maximum number of crossings that all moves may examine, minimum per
# move, and number of pilot moves that measure it.
LOOKED_AT_MAX, LOOKED_AT_MIN, PILOT = 20_000_000, 10, 2000
# Moves between two checks of the budget.
RUN = 10_000
SEED = 5
# Rows in the cache of crossings.
KNOWN_MAX = 4_000_000


@dataclass(frozen=True)
class WetGround:
    """Lines on the ground, and those that painting each node crosses.

    Attributes:
        nodes: Swaths, node by node.
        wheels: Wheels and casters.
        lines: Lines as rows of wet_paint.py, wet from the beginning.
        owner: (lines,) swath of each line; lines of other robots are numbered after the depot.
        over: (nodes, swaths, depot and others) number of crossings of each other swath while a node is painted.
        others_s: (others,) time at which other robots have painted half of each of their lines (s).
    """

    nodes: Sequence[Swath]
    wheels: Wheels
    lines: Floats
    owner: Ints
    over: Ints
    others_s: Floats

    @classmethod
    def of(cls, nodes: Sequence[Swath], segment: Ints, wheels: Wheels, others: Floats = NO_LINES) -> "WetGround":
        """Ground under nodes; each paints the swath numbered `segment`, and other robots paint `others` (rows)."""
        painted = [nodes[k].strokes for k in np.unique(segment, return_index=True)[1]]
        owner = np.repeat(np.arange(len(painted)), [len(strokes) for strokes in painted])
        own, ever = wet_rows(stroke.nozzle for strokes in painted for stroke in strokes), wheels.never_dry
        begun = np.searchsorted(owner, np.arange(len(painted)))
        met = (sum(ever.crossings(path, 0.0, 0.0, own) for path in node.paths) for node in nodes)
        over = np.array([np.add.reduceat(counts, begun) for counts in met])
        over[np.arange(len(nodes)), segment] = 0
        if not len(others):
            return cls(nodes, wheels, own, owner, over, np.zeros(0))
        foreign = others.copy()
        foreign[:, BEGUN:] = -1.0, math.inf
        met = (sum(ever.crossings(path, 0.0, 0.0, foreign) for path in node.paths) for node in nodes)
        over = np.column_stack((over, np.zeros(len(over), dtype=np.int64), np.array(list(met))))
        owner = np.concatenate((owner, len(painted) + 1 + np.arange(len(foreign))))
        middle_s = others[:, BEGUN] + 0.5 * others[:, LENGTH] / others[:, SPEED]
        return cls(nodes, wheels, np.concatenate((own, foreign)), owner, over, middle_s)


def wet_aware_order(scene: Scene, begin: Ints, budget: Budget = UNWATCHED) -> Ints:
    """Find the best order of nodes (segments,) from `begin` on, within the `budget`."""
    if not scene.crossing:
        return begin
    depot, segments = len(scene.ends), len(begin)
    cache = empty_cache(depot)
    best, costs = np.concatenate(([depot], begin)), np.full(2, np.inf)
    if not wet_times(scene, cache, best).any():
        return begin
    moves = min(max(MOVES_PER_SEGMENT * segments, MOVES_MIN), MOVES_MAX)
    affordable = int(LOOKED_AT_MAX / (LOOKED_AT_MIN + _looked_at(scene, cache, best)))
    many = segments > MANY or affordable < len(HEATS_S) * MOVES_MIN
    heats = HEATS_MANY_S if many else HEATS_S
    moves = min(moves, affordable // len(heats))
    for turn, heat in enumerate(heats):
        found = Incumbents(best.copy(), best, costs)
        for run in budget.parts(moves, RUN, turn / len(heats), (turn + 1) / len(heats)):
            anneal(scene, cache, found, Kicks(SEED + turn, run.start, run.stop, moves), heat)
    return best[1:]


def _looked_at(scene: Scene, cache: CrossingCache, tour: Ints) -> float:
    """Mean number of crossings that one move examines."""
    before = int(cache.looked_at[0])
    found = Incumbents(tour.copy(), tour.copy(), np.full(2, np.inf))
    anneal(scene, cache, found, Kicks(SEED, 0, PILOT, PILOT), HEATS_S[-1])
    return (int(cache.looked_at[0]) - before) / PILOT


def wet_times(scene: Scene, cache: CrossingCache, tour: Ints) -> Ints:
    """Crossings (n,) of wet paint after each position of a tour (the depot first) and on the next segment."""
    evaluation = TourEvaluation(all_painted(scene, len(tour)), np.zeros(len(tour), dtype=np.int64))
    evaluate(scene, cache, tour, (0, len(tour) - 1), 0.0, evaluation)
    return evaluation.wet


def empty_cache(nodes: int) -> CrossingCache:
    """Create an empty cache for a number of nodes and the depot."""
    first = np.full((nodes + 1, nodes + 1), UNKNOWN, dtype=np.int32)
    return CrossingCache(first, np.empty((KNOWN_MAX, 2), dtype=np.int32), *np.zeros((2, 1), dtype=np.int64))


def scene_of(
    problem: Problem,
    tracks: QuickestTransitions,
    ground: WetGround,
    crossing_s: float,
    run_out_m: float,
    end: PathPose | None,
) -> Scene:
    """Lay out a problem and its ground for the evaluation of tours.

    Args:
        problem: Ordering problem.
        tracks: Quickest transitions.
        ground: Lines on the ground.
        crossing_s: Price of a crossing of wet paint (s).
        run_out_m: Length of the straight after the last segment, if there is no end pose.
        end: Pose at which it stops.
    """
    segment, flip = problem.with_depot
    node, other = np.nonzero(ground.over)
    stop = end or PathPose(math.nan, math.nan, math.nan)
    return Scene(
        cost=problem.cost,
        segment=segment,
        flip=flip,
        modes=problem.modes,
        after=problem.after,
        paint=np.append(tracks.paint_s, 0.0),
        begins=np.array([*(swath.begin.pose for swath in ground.nodes), stop]),
        ends=np.array([swath.end.pose for swath in ground.nodes]),
        kind=tracks.kind,
        pieces=tracks.pieces,
        counts=tracks.counts,
        over_from=np.searchsorted(node, np.arange(problem.depot + 2)),
        over=np.column_stack((other, ground.over[node, other])),
        lines=WetLines(ground.lines, boxes_of(ground.lines)),
        owner=ground.owner,
        others_s=ground.others_s,
        contacts=ground.wheels.never_dry.looked_at_every(STEP_M),
        drying=ground.wheels.drying_s,
        crossing=crossing_s,
        run_out=run_out_m,
    )
