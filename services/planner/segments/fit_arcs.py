"""Approximation of a path by lines and arcs, which is all that the robot executes.

Lines and arcs stay as they are. A clothoid becomes biarcs: two arcs that begin and end exactly at points of the
clothoid with its headings, so no error builds up (Bolton, "Biarc curves", Computer-Aided Design 7(2), 1975; drawings
have the same for thousands at once, in columns). A biarc with equal tangents over a length h of sharpness σ stays
within σh³/324 of the clothoid, which gives the longest h for the tolerance.
"""

import cmath
import math
from typing import NamedTuple

from touchline.schemas.curves import Curve
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath

TOLERANCE_M = 1e-3
# The bound is of leading order, and up to 7 % too low at the tightest turns.
TOLERANCE_SHARE = 0.9
# A shorter span (m) would give segments of about a millimetre: it is merged with some of its neighbour.
SPAN_MIN_M = 5e-3
BLEND_M = 0.03
# An arc that turns less than this is a line; the resulting heading gap is far below 1e-9.
STRAIGHT_TURN_RAD = 1e-11
ROUNDING_1PM = 1e-9


class Cut(NamedTuple):
    """Line or arc to send, and the interval of ideal arc length (m) that it approximates."""

    curve: Curve
    ideal_from_m: float
    ideal_to_m: float


class _Span(NamedTuple):
    start_m: float
    end_m: float
    biarcs: int

    @property
    def length_m(self) -> float:
        return self.end_m - self.start_m


def cut(
    path: PiecePath,
    goal: PathPose | None = None,
    tolerance_m: float = TOLERANCE_M,
    curvature_max_1pm: float = math.inf,
) -> list[Cut]:
    """Approximate a path by lines and arcs, each beginning at the end pose of the last one.

    Args:
        path: Path of lines, arcs and clothoids.
        goal: End pose of the last curve: the path's end but for rounding.
        tolerance_m: Maximum distance from the path.
        curvature_max_1pm: A short span is merged with its neighbours only within this curvature.
    """
    cuts: list[Cut] = []
    for span in _without_slivers(path, _spans(path, tolerance_m), curvature_max_1pm):
        if not span.biarcs:
            pose, piece = path.pose_at(span.start_m), path.pieces[path.index_at(0.5 * (span.start_m + span.end_m))]
            cuts.append(Cut(_curve(pose, piece.curvature_1pm, span.length_m), span.start_m, span.end_m))
            continue
        ends = [span.start_m + span.length_m * i / span.biarcs for i in range(span.biarcs)] + [span.end_m]
        poses = [path.pose_at(s) for s in ends]
        if goal is not None and span.end_m == path.length_m:
            poses[-1] = goal
        for i in range(span.biarcs):
            first, second = biarc(poses[i], poses[i + 1])
            middle = 0.5 * (ends[i] + ends[i + 1])
            cuts += Cut(first, ends[i], middle), Cut(second, middle, ends[i + 1])
    return cuts


def biarc(start: PathPose, goal: PathPose) -> tuple[Curve, Curve]:
    """Two arcs from `start` to `goal` that meet in a common tangent, with control tangents of equal length.

    Raises:
        ZeroDivisionError: The poses coincide.
    """
    chord = goal.point - start.point
    tangents = start.direction + goal.direction
    along = _dot(chord, tangents)
    spread = 2.0 * (1.0 - _dot(start.direction, goal.direction))
    square = _dot(chord, chord)
    handle = square / (along + math.sqrt(along * along + spread * square))
    near, far = start.point + handle * start.direction, goal.point - handle * goal.direction
    joint = 0.5 * (near + far)
    return _arc_to(start, joint), _arc_to(PathPose(joint.real, joint.imag, cmath.phase(far - near)), goal.point)


def _arc_to(start: PathPose, end: complex) -> Curve:
    chord = end - start.point
    half_turn = cmath.phase(chord / start.direction)
    length = abs(chord) * (half_turn / math.sin(half_turn) if half_turn else 1.0)
    return _curve(start, 2.0 * half_turn / length, length)


def _curve(start: PathPose, curvature_1pm: float, length_m: float) -> Curve:
    if abs(curvature_1pm * length_m) < STRAIGHT_TURN_RAD:
        curvature_1pm = 0.0
    return Curve(start.x_m, start.y_m, start.heading_rad, curvature_1pm, length_m)


def _dot(a: complex, b: complex) -> float:
    return a.real * b.real + a.imag * b.imag


def _spans(path: PiecePath, tolerance_m: float) -> list[_Span]:
    spans = []
    for start, end, piece in zip(path.stations, path.stations[1:], path.pieces, strict=False):
        biarcs = 0
        if piece.sharpness_1pm2:
            longest = (324.0 * TOLERANCE_SHARE * tolerance_m / abs(piece.sharpness_1pm2)) ** (1.0 / 3.0)
            biarcs = math.ceil(piece.length_m / longest)
        spans.append(_Span(start, end, biarcs))
    return spans


def _without_slivers(path: PiecePath, spans: list[_Span], curvature_max_1pm: float) -> list[_Span]:
    """Merge each span that is too short with parts of its neighbours into one biarc.

    It takes the longer neighbour, unless the biarc would be tighter than the path, as after a sliver bent to the other
    side; then the other one, or both, whichever is least tight. If that is too tight, the sliver stays.
    """
    staying: set[float] = set()
    while len(spans) > 1:
        slivers = [k for k, span in enumerate(spans) if span.length_m < SPAN_MIN_M and span.start_m not in staying]
        if not slivers:
            break
        i = min(slivers, key=lambda k: spans[k].length_m)
        beside = [k for k in (i - 1, i + 1) if 0 <= k < len(spans)]
        beside.sort(key=lambda k: spans[k].length_m, reverse=True)
        offers = [_blended(spans, i, taken) for taken in (*((k,) for k in beside), tuple(beside))]
        tighter = [_tighter_1pm(path, blend) for blend, _ in offers]
        blend, blended = offers[tighter.index(min(tighter))]
        if _bend_1pm(path, blend) > curvature_max_1pm:
            staying.add(spans[i].start_m)
        else:
            spans = blended
    return spans


def _blended(spans: list[_Span], i: int, taken: tuple[int, ...]) -> tuple[_Span, list[_Span]]:
    """Extend span `i` by 3 cm of each neighbour `taken`, or all of a short one; also return all spans after that."""
    start, end = spans[i].start_m, spans[i].end_m
    first, last = spans[:i], spans[i + 1 :]
    if i - 1 in taken:
        short = first[-1].length_m < 2.0 * BLEND_M
        start = first[-1].start_m if short else start - BLEND_M
        first = [*first[:-1], *([] if short else [first[-1]._replace(end_m=start)])]
    if i + 1 in taken:
        short = last[0].length_m < 2.0 * BLEND_M
        end = last[0].end_m if short else end + BLEND_M
        last = [*([] if short else [last[0]._replace(start_m=end)]), *last[1:]]
    blend = _Span(start, end, 1)
    return blend, [*first, blend, *last]


def _tighter_1pm(path: PiecePath, span: _Span) -> float:
    """Excess curvature (1/m) of the biarc over a span beyond the path's maximum there, at least 0."""
    ideal = 0.0
    for start, end, piece in zip(path.stations, path.stations[1:], path.pieces, strict=False):
        if start < span.end_m and end > span.start_m:
            at = (max(span.start_m - start, 0.0), min(span.end_m - start, piece.length_m))
            ideal = max(ideal, *(abs(piece.curvature_at(s)) for s in at))
    return max(0.0, _bend_1pm(path, span) - ideal - ROUNDING_1PM)


def _bend_1pm(path: PiecePath, span: _Span) -> float:
    """Maximum |curvature| of the biarc over a span (1/m)."""
    return max(abs(arc.curvature_1pm) for arc in biarc(path.pose_at(span.start_m), path.pose_at(span.end_m)))
