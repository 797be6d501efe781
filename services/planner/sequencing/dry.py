"""The wet-aware tour: keeps wheels off wet paint where that is worth the time, by simulated annealing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchline.core.arcs import LENGTH
from touchline.services.planner.budget import UNWATCHED, Budget
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose
from touchline.services.planner.sequencing.annealing import Incumbents, anneal
from touchline.services.planner.sequencing.costs import Tracks
from touchline.services.planner.sequencing.order import Problem
from touchline.services.planner.sequencing.scene import STEP_M, UNKNOWN, Judgement, Known, Scene, all_painted, judged
from touchline.services.planner.sequencing.search import Kicks
from touchline.services.planner.sequencing.wet import BEGUN, NO_LINES, SPEED, WetLines, Wheels, boxes_of, wet_rows
from touchline.services.planner.swaths.swaths import Swath

# The budget: so many moves for every segment, within bounds, as often as there are heats (s) to begin with, each time
# from the best order so far. Many segments would not get back to it from the greater heats within so few moves.
MOVES_PER_SEGMENT, MOVES_MIN, MOVES_MAX = 4000, 20_000, 120_000
HEATS_S, HEATS_MANY_S, MANY = (4.0, 2.0, 1.0, 4.0, 2.0, 1.0), (0.6, 0.3), 150
# Where much is run over a move takes long: all moves together may look at so many crossings, each at some at least.
# How many they look at is learned from a few moves first.
LOOKED_AT_MAX, LOOKED_AT_MIN, PILOT = 20_000_000, 10, 2000
# Moves between two looks at whether that is enough.
RUN = 10_000
SEED = 5
# Rows of what is run over that are remembered at a time.
KNOWN_MAX = 4_000_000


@dataclass(frozen=True)
class WetGround:
    """What painting the nodes of a problem runs over.

    Attributes:
        nodes: The swaths.
        wheels: What touches the ground.
        lines: Their lines as rows of wet.py, wet from the beginning.
        owner: (lines,) which swath each line belongs to; those of other robots are numbered on behind the depot.
        over: (nodes, swaths, depot and others) how often a node's wheels and casters run over each other swath.
        others_s: (others,) when other robots paint theirs: half of it is done (s).
    """

    nodes: Sequence[Swath]
    wheels: Wheels
    lines: Floats
    owner: Ints
    over: Ints
    others_s: Floats

    @classmethod
    def of(cls, nodes: Sequence[Swath], segment: Ints, wheels: Wheels, others: Floats = NO_LINES) -> "WetGround":
        """The ground under nodes; each paints the swath numbered `segment`, and other robots paint `others` (rows)."""
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


def ordered_dry(scene: Scene, begin: Ints, budget: Budget = UNWATCHED) -> Ints:
    """The nodes (segments,) in the best order found from `begin` on, within the `budget`."""
    if not scene.crossing:
        return begin
    depot, segments = len(scene.ends), len(begin)
    known = unknown_yet(depot)
    best, costs = np.concatenate(([depot], begin)), np.full(2, np.inf)
    if not wet_times(scene, known, best).any():
        return begin
    moves = min(max(MOVES_PER_SEGMENT * segments, MOVES_MIN), MOVES_MAX)
    affordable = int(LOOKED_AT_MAX / (LOOKED_AT_MIN + _looked_at(scene, known, best)))
    many = segments > MANY or affordable < len(HEATS_S) * MOVES_MIN
    heats = HEATS_MANY_S if many else HEATS_S
    moves = min(moves, affordable // len(heats))
    for turn, heat in enumerate(heats):
        found = Incumbents(best.copy(), best, costs)
        for run in budget.parts(moves, RUN, turn / len(heats), (turn + 1) / len(heats)):
            anneal(scene, known, found, Kicks(SEED + turn, run.start, run.stop, moves), heat)
    return best[1:]


def _looked_at(scene: Scene, known: Known, tour: Ints) -> float:
    """How many crossings one move looks at on average."""
    before = int(known.looked_at[0])
    found = Incumbents(tour.copy(), tour.copy(), np.full(2, np.inf))
    anneal(scene, known, found, Kicks(SEED, 0, PILOT, PILOT), HEATS_S[-1])
    return (int(known.looked_at[0]) - before) / PILOT


def wet_times(scene: Scene, known: Known, tour: Ints) -> Ints:
    """(n,) how often wheels meet wet paint behind each position of a tour (the depot first) and on the next segment."""
    judgement = Judgement(all_painted(scene, len(tour)), np.zeros(len(tour), dtype=np.int64))
    judged(scene, known, tour, (0, len(tour) - 1), 0.0, judgement)
    return judgement.wet


def unknown_yet(nodes: int) -> Known:
    """An empty record of what is run over between so many nodes and the depot."""
    first = np.full((nodes + 1, nodes + 1), UNKNOWN, dtype=np.int32)
    return Known(first, np.empty((KNOWN_MAX, 2), dtype=np.int32), *np.zeros((2, 1), dtype=np.int64))


def scene_of(
    problem: Problem, tracks: Tracks, ground: WetGround, crossing_s: float, run_out_m: float, end: PathPose | None
) -> Scene:
    """What the search needs to evaluate a tour.

    Args:
        problem: What is ordered.
        tracks: The quickest transitions.
        ground: What painting the nodes runs over.
        crossing_s: What a crossing of wet paint may cost (s).
        run_out_m: So far the robot drives straight on behind the last segment, where it has no end.
        end: Where it stops.
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
