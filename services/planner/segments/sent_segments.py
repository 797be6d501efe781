"""LINE and ARC segments of the message for every section of the route."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count

from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import Piece, PiecePath
from touchline.services.planner.segments.fit_arcs import TOLERANCE_M, Cut, cut
from touchline.services.planner.segments.section import Section
from touchline.services.planner.segments.sections import runs
from touchline.services.planner.swaths.offset import Stroke

# Maximum number of segments in one message.
SENT_MAX = 100_000


@dataclass(frozen=True)
class Sent:
    """One line or arc, as sent.

    The curve is as travelled; `direction` is −1 where the robot faces backward along it. A turn on the spot by
    `spin_rad` is a segment of its own, without length. `start_m` and `end_m` are arc lengths along what is sent,
    `ideal_from_m` and `ideal_to_m` along the ideal curve that it approximates. Curvature (1/m) and sharpness (1/m²)
    are the maximum magnitudes on either of the two. It is `worked` if it is driven for the work along it.
    """

    id: str
    label: str
    curve: Curve
    start_m: float
    end_m: float
    ideal_from_m: float
    ideal_to_m: float
    curvature_1pm: float
    sharpness_1pm2: float
    stroke: Stroke | None
    direction: int = 1
    spin_rad: float = 0.0
    worked: bool = False


def send(
    sections: list[Section],
    step: Callable[[float], None],
    tolerance_m: float = TOLERANCE_M,
    curvature_max_1pm: float = math.inf,
) -> list[Sent]:
    """Approximate all sections by lines and arcs; a painted segment is sent as the one curve that it is.

    Args:
        sections: Sections of the route.
        step: Called with the fraction done.
        tolerance_m: Maximum distance from the ideal curve.
        curvature_max_1pm: Pieces are merged only within this curvature.

    Raises:
        PlanningError: There are too many lines and arcs for one message.
    """
    taken = {section.work_id for section in sections}
    names = (name for k in count() if (name := f"t{k}") not in taken)
    sent: list[Sent] = []
    station = ideal = 0.0
    for i, section in enumerate(sections):
        following = sections[i + 1].path.start if i + 1 < len(sections) else None
        for run in runs(section.path, following):
            if run.spin_rad:
                at = (station, station, ideal, ideal)
                turned = Curve(run.path.start.x_m, run.path.start.y_m, run.path.start.heading_rad, 0.0, 0.0)
                sent.append(Sent(next(names), section.label, turned, *at, 0.0, 0.0, None, 0, run.spin_rad))
            stroke, whole = section.stroke, run.path.length_m
            if stroke:
                cuts = [Cut(stroke.robot, 0.0, whole)]
            else:
                cuts = cut(run.path, run.goal, tolerance_m, curvature_max_1pm)
            for piece in cuts:
                end = station + piece.curve.length_m
                curvature, sharpness = _largest(run.path, piece)
                name = section.work_id or next(names)
                span = (station, end, ideal + piece.ideal_from_m, ideal + piece.ideal_to_m)
                largest = (curvature, sharpness)
                worked = section.work_id != ""
                driven = Sent(name, section.label, piece.curve, *span, *largest, stroke, run.direction, worked=worked)
                sent.append(driven)
                station = end
            ideal += whole
        if len(sent) > SENT_MAX:
            raise PlanningError("", f"needs more than {SENT_MAX:,} lines and arcs", "split the template into several")
        step((i + 1) / len(sections))
    return sent


def _largest(path: PiecePath, piece: Cut) -> tuple[float, float]:
    """Maximum |curvature| and |sharpness| of the ideal path under a cut, and of the cut itself."""
    curvature, sharpness = abs(piece.curve.curvature_1pm), 0.0
    for start, ideal in _overlapping(path, piece):
        ends = (max(piece.ideal_from_m - start, 0.0), min(piece.ideal_to_m - start, ideal.length_m))
        curvature = max(curvature, *(abs(ideal.curvature_at(s)) for s in ends))
        sharpness = max(sharpness, abs(ideal.sharpness_1pm2))
    return curvature, sharpness


def _overlapping(path: PiecePath, piece: Cut) -> Iterator[tuple[float, Piece]]:
    middle = 0.5 * (piece.ideal_from_m + piece.ideal_to_m)
    for start, end, ideal in zip(path.stations, path.stations[1:], path.pieces, strict=False):
        if (piece.ideal_from_m < end and piece.ideal_to_m > start) or start <= middle <= end:
            yield start, ideal
