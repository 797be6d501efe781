"""CCD of the study: continuous-curvature Dubins as the study describes it, with the failures that it reports.

- Only the families LSL, RSR, LRL and RLR; the one to drive is chosen by its length as a *plain* Dubins path.
- A turn below θ_lim = κ²/σ adds a full circle.
- A transition begins and ends with curvature 0, so every joint with an arc steps.
- Poses closer than 0.1 m fail.
- Clothoids are sent as evenly spaced straight lines (see sent.py).

Where the description is open, the choice favours the study: a goal straight ahead is reached straight, a family without
a continuous-curvature path yields to the next, and the middle circle of LRL is the better one.
"""

import math

from touchline.core.angles import TAU
from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import PathPose, Piece
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.turns import ArcTurn, ContinuousTurn
from touchline.services.planner.steering.words import Word, words

FAMILIES = ("LSL", "RSR", "LRL", "RLR")
CLOSEST_M = 0.1


class WindingTurn:
    """CC turn without partial turns: below the limit deflection it adds a full circle."""

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self._regular = ContinuousTurn(curvature_max_1pm, sharpness_max_1pm2)
        self.centre = self._regular.centre

    def length(self, deflection_rad: float) -> float:
        """Arc length of the turn (m)."""
        return self._regular.length(self._wound(deflection_rad))

    def pieces(self, deflection_rad: float) -> tuple[Piece, ...]:
        """Pieces of the turn: clothoid, arc, clothoid."""
        return self._regular.pieces(self._wound(deflection_rad))

    def _wound(self, deflection_rad: float) -> float:
        return deflection_rad + TAU if deflection_rad < self._regular.limit_deflection else deflection_rad


class StudyContinuousDubins:
    """Transitions of the study within a maximum curvature (1/m) and a maximum sharpness (1/m²)."""

    name = "study-ccd"

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self.turn = WindingTurn(curvature_max_1pm, sharpness_max_1pm2)
        self._plain = ArcTurn(curvature_max_1pm)

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Return no pieces: an arc is entered with a step of curvature."""
        return ()

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Return no pieces: an arc is left with a step of curvature."""
        return ()

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """Connect the poses, regardless of the curvatures there."""
        return self.connect(start.pose, goal.pose)

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        """Return no transitions: the study's robot only drives forward."""
        return []

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        """Path of the chosen family.

        Raises:
            PlanningError: The poses are closer than 0.1 m.
        """
        if abs(goal.point - start.point) < CLOSEST_M:
            raise PlanningError("", f"joins poses closer than {CLOSEST_M} m", "use another method than the study's")
        own = list(words(start, goal, self.turn))
        for word in own:
            if word.letters == "S":
                return word.pieces(self.turn)
        plain = _shortest_of_each(list(words(start, goal, self._plain)), self._plain)
        continuous = _shortest_of_each(own, self.turn)
        chosen = min(continuous, key=lambda letters: plain[letters][0] if letters in plain else math.inf)
        return continuous[chosen][1].pieces(self.turn)


def _shortest_of_each(found: list[Word], turn: ArcTurn | WindingTurn) -> dict[str, tuple[float, Word]]:
    """Length and word of each existing family of the four; a single turn counts as LSL or RSR."""
    best: dict[str, tuple[float, Word]] = {}
    for word in found:
        letters = {"L": "LSL", "R": "RSR"}.get(word.letters, word.letters)
        length = word.length(turn)
        if letters in FAMILIES and (letters not in best or length < best[letters][0]):
            best[letters] = length, word
    return best
