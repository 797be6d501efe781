"""Lines and arcs that each planner sends to the robot, for the comparison of joints."""

import numpy as np

from touchline.core.angles import wrapped_all
from touchline.schemas.curves import along
from touchline.services.planner.geometry.clothoid import Floats, PiecePath
from touchline.services.planner.segments.fit_arcs import cut

# Length (m) of the straight lines into which the study cuts clothoids; it does not give it, so it is short here.
CHORD_M = 0.002


def as_chords(path: PiecePath) -> Floats:
    """Convert a path to rows (n, 5) of x (m), y (m), heading (rad), curvature (1/m) and length (m), as the study does.

    Lines and arcs stay as they are; clothoids become straight lines of about `CHORD_M` between points on them.
    """
    rows: list[Floats] = []
    for pose, piece in zip(path.knots, path.pieces, strict=False):
        if piece.sharpness_1pm2 == 0.0:
            rows.append(np.array([[*pose, piece.curvature_1pm, piece.length_m]]))
            continue
        count = max(1, round(piece.length_m / CHORD_M))
        x, y, _, _ = PiecePath(pose, (piece,)).sample(np.linspace(0.0, piece.length_m, count + 1))
        dx, dy = np.diff(x), np.diff(y)
        rows.append(np.column_stack((x[:-1], y[:-1], np.arctan2(dy, dx), np.zeros(count), np.hypot(dx, dy))))
    return np.concatenate(rows) if rows else np.zeros((0, 5))


def as_biarcs(path: PiecePath) -> Floats:
    """Convert a path to the same rows as Touchline does: clothoids become biarcs."""
    curves = [piece.curve for piece in cut(path)]
    return np.array([(c.x_m, c.y_m, c.heading_rad, c.curvature_1pm, c.length_m) for c in curves]).reshape(-1, 5)


def joints(rows: Floats) -> tuple[Floats, Floats, Floats]:
    """Steps (n-1,) of position (m), heading (rad) and curvature (1/m) at the joints between rows (n, 5)."""
    x, y, heading, curvature, length = rows.T
    end_x, end_y, end_heading, _ = along(x, y, heading, curvature, length)
    gap = np.hypot(x[1:] - end_x[:-1], y[1:] - end_y[:-1])
    kink = np.abs(wrapped_all(heading[1:] - end_heading[:-1]))
    return gap, kink, np.abs(np.diff(curvature))
