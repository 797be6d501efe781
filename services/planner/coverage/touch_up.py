"""Touch-up: inserts strokes over missed patches where that is worth the time."""

from collections.abc import Callable, Iterator

import numpy as np

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.kernels.patch_labels import label_patches
from touchline.services.planner.coverage.kernels.turn_pieces import words_s
from touchline.services.planner.coverage.stroke_chain import StrokeChain
from touchline.services.planner.coverage.stroke_transition import ZONE_M
from touchline.services.planner.geometry.clothoid import Floats, PathPose

# Smaller patches (m²) are ignored; with a narrow tool, those smaller than this share of its width squared.
PATCH_MIN_M2, PATCH_SHARE = 0.15, 0.125
# Positions in the plan that are tried for each stroke, those with the shortest detour first.
PLACES_TRIED = 4
# Candidate strokes that are tried in a round.
OFFERS_TRIED = 6
# A stroke extends this far (m) beyond its patches, and bridges gaps between them up to the second length.
BEYOND_M, GAP_M = 1.0, 14.0


def patches(chain: StrokeChain) -> list[Floats]:
    """Cell centres (n, 2) of each missed patch that is large enough, the largest first."""
    grid = chain.finder.covered.grid
    missed = grid.wanted & (grid.passes == 0)
    rows, columns = np.nonzero(missed)
    which = label_patches(missed)[rows, columns]
    order = np.argsort(which, kind="stable")
    places = np.column_stack((grid.x_m + (columns + 0.5) * grid.cell_m, grid.y_m + (rows + 0.5) * grid.cell_m))[order]
    parts = np.split(places, np.searchsorted(which[order], np.arange(2, which.max(initial=0) + 1)))
    least_m2 = min(PATCH_MIN_M2, PATCH_SHARE * (2.0 * grid.half_width_m) ** 2)
    large = [part for part in parts if len(part) * grid.cell_m**2 >= least_m2]
    return sorted(large, key=len, reverse=True)


def touch_ups(missed: list[Floats], headings: list[float], space: FreeSpace) -> Iterator[tuple[CoverStroke, float]]:
    """Generate strokes over patches at the given headings, one for each row of patches that one pass can cover.

    With each comes its lead: the length (m) up to the first patch, along which it may be joined anywhere.

    Args:
        missed: (n, 2) cell centres of each patch (m, map frame).
        headings: Headings of the strokes (rad).
        space: Free space of the machine.
    """
    half = 0.5 * space.machine.width_m
    for heading in headings:
        cos, sin = np.cos(heading), np.sin(heading)
        # Not by BLAS: its threads take many times the time beside other processes, and its bits depend on the machine.
        spans = [(cos * p[:, 0] + sin * p[:, 1], cos * p[:, 1] - sin * p[:, 0]) for p in missed]
        laid: dict[float, list[tuple[CoverStroke, float]]] = {}
        for _, seed in spans:
            # The pass is centred on the patch, or has an edge along it; it covers what else is within it.
            for level in {round(v, 1) for v in (0.5 * (seed.min() + seed.max()), seed.min() + half, seed.max() - half)}:
                if level not in laid:
                    inside = [a[within] for a, c in spans if (within := abs(c - level) < half).any()]
                    extents = sorted((i.min(), i.max()) for i in inside)
                    laid[level] = [*_strokes(extents, level, heading, space)] if inside else []
                yield from laid[level]


def _strokes(
    extents: list[tuple[float, float]], level: float, heading: float, space: FreeSpace
) -> Iterator[tuple[CoverStroke, float]]:
    first, last = extents[0]
    rows = []
    for a, b in extents[1:]:
        if a - last > GAP_M:
            rows.append((first, last))
            first, last = a, b
        last = max(last, b)
    rows.append((first, last))
    for a, b in rows:
        x = a * np.cos(heading) - level * np.sin(heading)
        y = a * np.sin(heading) + level * np.cos(heading)
        pose = PathPose(float(x), float(y), heading)
        for start, end in space.stretches(pose, b - a + BEYOND_M, ZONE_M):
            if end > 0.0 and start < b - a:
                at = pose.moved(complex(start, 0.0), 0.0)
                yield CoverStroke(DriveKind.TOUCH_UP, "touch-up", at, end - start), max(-start, 0.0)


def places(chain: StrokeChain, stroke: CoverStroke, lead_m: float, most: int = PLACES_TRIED) -> list[int]:
    """Indices of strokes of a chain after which a stroke costs least, roughly; always with the last one."""
    last = len(chain.transitions)
    if not last:
        return [last]
    mover, joins = chain.finder.mover, list(zip(chain.transitions, chain.strokes, chain.strokes[1:], strict=False))
    leaves = np.array([before.at(join.depart_m) for join, before, _ in joins])
    arrives = np.array([after.at(join.arrive_m) for join, _, after in joins])
    there = words_s(leaves, np.array([stroke.at(lead_m)]), mover)[:, 0]
    around = there + words_s(np.array([stroke.at(stroke.length_m)]), arrives, mover)[0]
    driven = np.array([join.path.length_m for join in chain.transitions])
    return [last, *np.argsort(around - driven / mover.speed_mps, kind="stable")[:most].tolist()]


def touched_up(chain: StrokeChain, headings: list[float], enough_m2: float, report: Callable[[], None]) -> int:
    """Insert strokes while they are worth it and more than `enough_m2` is missed; return their number.

    `report` is called before each trial, and may raise to end the search.

    Args:
        chain: Chain, changed in place.
        headings: Headings of the strokes (rad).
        enough_m2: Missed area at which the search ends.
        report: Called before each trial.
    """
    finder, done = chain.finder, 0
    worth, tried = chain.score_s, set[tuple[float, ...]]()
    while finder.covered.missed_m2 > enough_m2:
        for _, key, stroke, lead in _offers(chain, headings, tried):
            tried.add(key)
            report()
            before, best = chain.state, None
            for k in places(chain, stroke, lead):
                if chain.insert(k, stroke) and chain.score_s < (best[0] if best else worth):
                    best = chain.score_s, chain.state
                chain.restore(before)
            if best:
                worth, done = best[0], done + 1
                chain.restore(best[1])
                break
        else:
            return done
    return done


def _offers(
    chain: StrokeChain, headings: list[float], tried: set[tuple[float, ...]]
) -> list[tuple[float, tuple[float, ...], CoverStroke, float]]:
    """Promising strokes, the best first: rough score (s), key, stroke, lead (m)."""
    finder, found = chain.finder, []
    for stroke, lead in touch_ups(patches(chain), headings, finder.space):
        key = tuple(round(v, 1) for v in (*stroke.start, stroke.length_m))
        if key in tried:
            continue
        gain = finder.covered.add(stroke.part(lead, stroke.length_m), 0)
        score = (stroke.length_m - lead) / finder.mover.speed_mps - gain * finder.seconds_per_m2
        if score < 0.0:
            found.append((score, key, stroke, lead))
    return sorted(found, key=lambda offer: offer[:2])[:OFFERS_TRIED]
