"""Tour: order and directions of the swaths, as given or in the least time, and the itinerary along it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Budget, Progress
from touchline.services.planner.collision.checker import Collision, CollisionChecker
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.route.itinerary import Itinerary, ItineraryBuilder
from touchline.services.planner.sequencing.costs import nodes_of, problem
from touchline.services.planner.sequencing.order import kicks_for, ordered
from touchline.services.planner.sequencing.wet_aware_order import WetGround, scene_of, wet_aware_order
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.swaths.swaths import Swath

GIVEN, OPTIMISED = "given", "optimised"
# Stages of progress: timing the transitions between segments, and searching for the best order.
TIMING, ORDER = "timing transitions", "order"
# Price of crossing a wet line (s): by default, if it is forbidden, and in the search if it is forbidden, which needs no
# higher one.
CROSSING_S, FORBIDDEN_S, SEARCHED_CROSSING_S = 1.25, 1000.0, 15.0
COLLISION_S = 1e6
DRYING_MAX_S = 1e6
# Maximum numbers of segments: of an ordered tour, whose matrix has to fit into memory, and of a message.
ORDERED_MAX, SEGMENTS_MAX = 1500, 10_000
# Rounds of search; between them collisions, which the matrix lacks, are learned from the itinerary.
ROUNDS = 6
# The same while a segment is not reached: it would be shortened, or the template refused.
MOST_ROUNDS = 12
# Number of swaths from which the start is at fault if none of them can be reached from it.
MANY_SWATHS = 3
# Partners of a swath that are looked at once one collides.
LOOKED_AT = 4
# Share of the kicks in later searches, which begin with the last order.
AGAIN = 0.25


def ordering(options: PlanOptions) -> bool:
    """True if the options ask for the quickest order.

    Raises:
        PlanningError: The order that they ask for is unknown.
    """
    if options.order not in ("", GIVEN, OPTIMISED):
        raise PlanningError("", f'asks for the unknown order "{options.order}"', f"use {OPTIMISED} or {GIVEN}")
    return options.order != GIVEN


def refuse_too_many(segments: int) -> None:
    """Refuse a template that exceeds the segment limit.

    Raises:
        PlanningError: It does.
    """
    if segments > SEGMENTS_MAX:
        raise PlanningError("", f"has {segments:,} segments, more than {SEGMENTS_MAX:,}", "split the template")


def drying_s(vehicle: Vehicle, options: PlanOptions) -> float:
    """Drying time of the paint (s); 0 for a vehicle that does not paint.

    Raises:
        PlanningError: The option is not a positive time.
    """
    if not 0.0 <= options.drying_time_s < DRYING_MAX_S:
        problem = f"has drying_time_s = {options.drying_time_s:g}"
        raise PlanningError("", problem, f"give 0 (the vehicle's own) to {DRYING_MAX_S:g} s")
    return options.drying_time_s or vehicle.tool.drying_s if vehicle.tool.paints else 0.0


def crossing_cost_s(options: PlanOptions) -> float:
    """Price of one crossing of a wet line (s)."""
    return FORBIDDEN_S if options.hard_drying else CROSSING_S


def arranged(
    modes: Sequence[Sequence[Swath]],
    driver: ItineraryBuilder,
    options: PlanOptions,
    progress: Progress,
    enough: Callable[[], bool],
) -> Itinerary:
    """Choose one mode of every swath, the order, and the transitions between them.

    Args:
        modes: Modes of every swath, in the order of the template.
        driver: Builder of the itinerary, which chooses the transitions.
        options: Options of the plan.
        progress: Called with the stage and the fraction of it that is done.
        enough: Returns whether to take the best order so far.

    Raises:
        PlanningError: There are too many swaths to order; or a segment cannot be painted or reached without a
            collision, or, where that is forbidden, without driving over wet paint.
    """
    if ordering(options) and len(modes) > ORDERED_MAX:
        problem = f"has {len(modes):,} lines that do not continue each other, more than {ORDERED_MAX:,}"
        raise PlanningError("", problem, "split the template or paint it in the given order")
    modes = [_clear_of_outlines(choice, driver.checker) for choice in modes]
    if ordering(options):
        drive = _optimised(modes, driver, progress, enough)
    else:
        drive = driver.drive([choice[0] for choice in modes])
        progress(ORDER, 1.0)
    _refuse_collisions(drive)
    if options.hard_drying:
        _refuse_crossings(drive)
    return drive


def _optimised(
    modes: Sequence[Sequence[Swath]], driver: ItineraryBuilder, progress: Progress, enough: Callable[[], bool]
) -> Itinerary:
    """Search for the best itinerary.

    A tour that returns, without a given start pose, is ordered twice: the second time for the start that the first one
    chose.
    """
    drive = _found(modes, driver, progress, enough)
    if driver.returns and driver.start is None and not enough():
        begin = drive.legs[0].path.start
        again = _found(modes, replace(driver, start=begin, end=begin), progress, enough)
        drive = min(drive, again, key=lambda each: _total(each, driver))
    return drive


def _found(
    modes: Sequence[Sequence[Swath]], driver: ItineraryBuilder, progress: Progress, enough: Callable[[], bool]
) -> Itinerary:
    nodes, segment, _ = nodes_of(modes)
    end = driver.start if driver.returns else driver.end
    first, last = (CurveEnd(pose, 0.0) if pose else None for pose in (driver.start, end))
    asked, tracks = problem(
        modes, driver.transitions, driver.painting, first, last, Budget(partial(progress, TIMING), enough)
    )
    ground = WetGround.of(nodes, segment, driver.wheels, driver.others)
    crossing_s = min(driver.crossing_s, SEARCHED_CROSSING_S)
    cost, kicks = asked.cost.copy(), kicks_for(asked)
    best: Itinerary | None = None
    step = partial(progress, ORDER)
    least, order = np.inf, None
    for turn in range(MOST_ROUNDS):
        # The quickest order, and from there on the one that is worth more time for fewer wet crossings.
        priced = asked.priced(cost)
        budget = Budget(Stage(step, 2 * turn), enough)
        order = ordered(priced, budget, int((AGAIN if turn else 1.0) * kicks), order)
        scene = scene_of(priced, tracks, ground, crossing_s, driver.run_out_m, end)
        dry = wet_aware_order(scene, order, Budget(Stage(step, 2 * turn + 1), enough))
        drive = driver.drive([nodes[k] for k in dry.tolist()])
        if (total := _total(drive, driver)) < least - 1e-6:
            best, least = drive, total
        changed = _learn(cost, drive, dry.tolist(), nodes, driver)
        if not changed or enough() or (turn + 1 >= ROUNDS and not drive.blocked):
            break
    step(1.0)
    assert best is not None, "there is at least one round"
    shut_in = driver.start is not None and 0 in best.blocked and len(modes) >= MANY_SWATHS
    if shut_in and all(driver.collides(None, node) for node in nodes):
        text = f"begins where the robot cannot get away: its body would touch {best.legs[0].collision}"
        raise PlanningError("", text, "make room there, or drive it off")
    return best


def _total(drive: Itinerary, driver: ItineraryBuilder) -> float:
    """Seconds of an itinerary, with the penalties for crossings and collisions."""
    return (
        drive.seconds + driver.crossing_s * (drive.wet_crossings + drive.wet_others) + COLLISION_S * len(drive.blocked)
    )


@dataclass(frozen=True)
class Stage:
    """Progress of one search as a fraction of all, of which there are mostly two."""

    step: Callable[[float], None]
    number: int

    def __call__(self, part: float) -> None:
        """Report the fraction of this search that is done."""
        self.step(1.0 - 0.5 ** min(self.number, 2) * (1.0 - 0.5 * part))


def _learn(cost: Floats, drive: Itinerary, order: list[int], nodes: Sequence[Swath], driver: ItineraryBuilder) -> bool:
    """Penalise pairs of nodes between which the itinerary collides, and all others with one of the two that do.

    Returns:
        Whether there are new ones.
    """
    depot = len(cost) - 1
    changed = False
    swaths = [*nodes, None]
    stops = [depot, *order, depot]
    for i, leg in enumerate(drive.legs):
        a, b = stops[i], stops[i + 1]
        if leg.collision and cost[a, b] < COLLISION_S:
            pairs, changed = {(a, b)}, True
            pairs |= {(a, k) for k in _likely(cost[a]) if driver.collides(swaths[a], nodes[k])}
            pairs |= {(k, b) for k in _likely(cost[:, b]) if driver.collides(nodes[k], swaths[b])}
            for pair in pairs:
                cost[pair] += COLLISION_S * (cost[pair] < COLLISION_S)
    return changed


def _likely(cost: Floats) -> list[int]:
    """Nodes (the depot excepted) that would come next to one, by the costs of all; without those known to collide."""
    order = np.argsort(cost[:-1], kind="stable")[:LOOKED_AT]
    return [k for k in order.tolist() if cost[k] < COLLISION_S]


def _clear_of_outlines(choice: Sequence[Swath], checker: CollisionChecker | None) -> list[Swath]:
    """Modes in which the body keeps off the outlines."""
    if checker is None:
        return list(choice)
    hits = [_first_hit(swath, checker) for swath in choice]
    clear = [swath for swath, hit in zip(choice, hits, strict=True) if hit is None]
    if not clear:
        assert hits[0]
        raise PlanningError(
            hits[0][0],
            f"cannot be painted: the robot's body would touch {hits[0][1]}",
            "move the line or the outline apart, or paint it by hand",
        )
    return clear


def _first_hit(swath: Swath, checker: CollisionChecker) -> tuple[str, Collision] | None:
    """First segment of a swath along which the body touches an outline, and the collision."""
    for stroke, path in zip(swath.strokes, swath.paths, strict=True):
        if hit := checker.collision(path):
            return stroke.id, hit
    return None


class UnreachableError(PlanningError):
    """A segment that cannot be reached, or left, without a collision.

    Attributes:
        parts: All segments that cannot be reached or left, with those at the other end of the transition.
    """

    def __init__(self, segment_id: str, problem: str, remedy: str, parts: tuple[str, ...]) -> None:
        """Create the error; `segment_id` is the first segment that is not reached."""
        super().__init__(segment_id, problem, remedy)
        self.parts = parts


def _refuse_collisions(drive: Itinerary) -> None:
    swaths, parts = drive.swaths, list[str]()
    for i in drive.blocked:
        parts += (swath.strokes[-1].id for swath in swaths[max(i - 1, 0) : i])
        parts += (swath.strokes[0].id for swath in swaths[i : i + 1])
    for i in drive.blocked:
        hit = drive.legs[i].collision
        if i == len(swaths):
            problem = f"leaves no room to stop after it: the robot's body would touch {hit}"
            remedy = "make room there, or end with another line"
            raise UnreachableError(drive.strokes[-1].id, problem, remedy, tuple(parts))
        origin = f'from "{swaths[i - 1].strokes[-1].id}"' if i else "from the start"
        problem = f"cannot be reached {origin}: the robot's body would touch {hit}"
        remedy = "make room there, or let the order be optimised"
        raise UnreachableError(swaths[i].strokes[0].id, problem, remedy, tuple(parts))


def _refuse_crossings(drive: Itinerary) -> None:
    for name, doing, over in _met(drive):
        if over.any():
            wet = drive.strokes[int(np.flatnonzero(over)[0])].id
            problem = f'cannot be {doing} without driving over "{wet}" while that is wet'
            raise PlanningError(name, problem, "shorten the drying time, or let wet paint be crossed")


def _met(drive: Itinerary) -> Iterator[tuple[str, str, Ints]]:
    """Crossings in driving order: segment, whether it is being reached or painted, crossings of each earlier one."""
    over = iter(drive.over)
    for swath, leg in zip(drive.swaths, drive.legs, strict=False):
        yield swath.strokes[0].id, "reached", leg.crossings
        for stroke in swath.strokes:
            yield stroke.id, "painted", next(over)
    yield drive.strokes[-1].id, "left", drive.legs[-1].crossings
