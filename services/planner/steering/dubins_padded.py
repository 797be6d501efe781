"""Method `dubins-padded`: plain Dubins between padded segments, the study's baseline."""

from touchline.services.planner.geometry.clothoid import PathPose, Piece
from touchline.services.planner.steering.dubins import dubins_pieces
from touchline.services.planner.steering.method import CurveEnd, through_straights

# Lengths (m) that the study drives straight before and after every painted segment, to lower the discs and to settle.
PADDING_BEFORE_M = 0.5
PADDING_AFTER_M = 0.1


class PaddedDubins:
    """Dubins transitions within a maximum curvature (1/m); curvature steps at every joint."""

    name = "dubins-padded"

    def __init__(self, curvature_max_1pm: float) -> None:
        self.curvature_max_1pm = curvature_max_1pm

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Straight padding before a segment, for any curvature."""
        return (Piece(PADDING_BEFORE_M),)

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Straight padding after a segment, for any curvature."""
        return (Piece(PADDING_AFTER_M),)

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        """Pieces of the optimal Dubins path."""
        return dubins_pieces(start, goal, self.curvature_max_1pm)

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """Lead-out, the shortest word between the straights, and lead-in."""
        return through_straights(self, start, goal)

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        """Return no transitions: all words are driven forward."""
        return []
