"""Plain Dubins paths: the shortest forward path of bounded curvature, which steps at every joint (see words.py)."""

from touchline.services.planner.geometry.clothoid import PathPose, Piece
from touchline.services.planner.steering.turns import ArcTurn
from touchline.services.planner.steering.words import shortest_word


def dubins_pieces(start: PathPose, goal: PathPose, curvature_max_1pm: float) -> tuple[Piece, ...]:
    """Pieces of the optimal Dubins path from `start` to `goal` (all six words; arcs at `curvature_max_1pm`)."""
    turn = ArcTurn(curvature_max_1pm)
    return shortest_word(start, goal, turn).pieces(turn)
