"""Method `ccd`: curvature-continuous Dubins transitions, G² from one painted curve to the next."""

import math

from touchline.services.planner.geometry.clothoid import PathPose, Piece
from touchline.services.planner.steering.method import CurveEnd, through_straights
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline.services.planner.steering.words import shortest_word


class ContinuousDubins:
    """CC-Dubins transitions within a maximum curvature (1/m) and a maximum sharpness (1/m²).

    A painted arc is left and reached by a clothoid between its curvature and zero, so the whole trajectory is
    continuous in curvature, arcs included.
    """

    name = "ccd"

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self.sharpness_max_1pm2 = sharpness_max_1pm2
        self.turn = ContinuousTurn(curvature_max_1pm, sharpness_max_1pm2)

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Clothoid from straight to `curvature_1pm`."""
        if curvature_1pm == 0.0:
            return ()
        sharpness = math.copysign(self.sharpness_max_1pm2, curvature_1pm)
        return (Piece(curvature_1pm / sharpness, 0.0, sharpness),)

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Clothoid from `curvature_1pm` to straight."""
        return tuple(Piece(p.length_m, curvature_1pm, -p.sharpness_1pm2) for p in self.lead_in(curvature_1pm))

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        """Shortest of the CC words."""
        return shortest_word(start, goal, self.turn).pieces(self.turn)

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """Lead-out, the shortest word between the straights, and lead-in."""
        return through_straights(self, start, goal)

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        """Return no transitions: all words are driven forward."""
        return []
