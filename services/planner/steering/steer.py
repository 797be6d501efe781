"""Method `g2`: the shortest way between any two poses and curvatures, continuous in curvature throughout."""

import math

import numpy as np

from services.planner.ccd import ContinuousDubins
from services.planner.clothoid import Floats, Piece, PiecePath, Pose, joined
from services.planner.method import CurveEnd, before, through_straights
from services.planner.steering.circles import circle
from services.planner.steering.forward import WITH_A_STRAIGHT, WORDS, shortest_forward, three_elements
from services.planner.steering.profile import DIRECTION, shape


class Steering:
    """Transitions within a largest curvature (1/m) and a largest sharpness (1/m²), from curvature to curvature."""

    name = "g2"

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self.words = ContinuousDubins(curvature_max_1pm, sharpness_max_1pm2)
        self.root = math.sqrt(sharpness_max_1pm2)
        self.circle: Floats = circle(curvature_max_1pm / self.root)
        self.curvature_cap_1pm = self.words.turn.curvature

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """The clothoid from straight to `curvature_1pm`."""
        return self.words.lead_in(curvature_1pm)

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """The clothoid from `curvature_1pm` to straight."""
        return self.words.lead_out(curvature_1pm)

    def connect(self, start: Pose, goal: Pose) -> tuple[Piece, ...]:
        """The shortest forward way between poses that are straight at both ends."""
        return self.between(CurveEnd(start, 0.0), CurveEnd(goal, 0.0))

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """The shortest forward way."""
        # Where κ_max²/σ_max exceeds π, ways keep to a smaller curvature than the painted curves may have.
        out_of, k_from = self._ramp_to_cap(start.curvature_1pm)
        back_into, k_to = self._ramp_to_cap(goal.curvature_1pm)
        into = tuple(Piece(p.length_m, p.curvature_end_1pm, -p.sharpness_1pm2) for p in reversed(back_into))
        leaving = CurveEnd(PiecePath(start.pose, out_of).end, k_from)
        reaching = CurveEnd(before(goal.pose, into), k_to)

        z, turn = reaching.pose.seen_from(leaving.pose)
        ends, amounts = np.array([k_from, k_to]) / self.root, np.zeros(3)
        _, family = shortest_forward(ends, z * self.root, math.remainder(turn, math.tau), self.circle, True, amounts)
        if family == WORDS:
            way = through_straights(self.words, leaving, reaching)
        else:
            elements = np.asarray(three_elements(family == WITH_A_STRAIGHT))
            way = self._pieces(elements, amounts, ends)
        return joined((*out_of, *way, *into))

    def _ramp_to_cap(self, curvature_1pm: float) -> tuple[tuple[Piece, ...], float]:
        """The clothoid from a curvature down to what a way may have, and the curvature (1/m) after it."""
        capped = math.copysign(min(abs(curvature_1pm), self.curvature_cap_1pm), curvature_1pm)
        if capped == curvature_1pm:
            return (), curvature_1pm
        sharpness = math.copysign(self.root * self.root, -curvature_1pm)
        return (Piece((capped - curvature_1pm) / sharpness, curvature_1pm, sharpness),), capped

    def _pieces(self, elements: Floats, amounts: Floats, ends: Floats) -> tuple[Piece, ...]:
        """The pieces of a profile (see profile.py)."""
        extreme, hold, rate = (np.empty(len(elements)) for _ in range(3))
        shape(elements, amounts, ends, float(self.circle[0]), extreme, hold, rate)
        pieces: list[Piece] = []
        k, last = float(ends[0]), 1
        for row, following, length in zip(elements.tolist(), extreme.tolist(), hold.tolist(), strict=True):
            direction = int(row[DIRECTION])
            if direction == last:
                pieces.append(self._ramp(k, following, direction))
            pieces.append(Piece(length / self.root, following * self.root, 0.0, direction))
            k, last = following, direction
        if last == 1:
            pieces.append(self._ramp(k, float(ends[1]), 1))
        return tuple(pieces)

    def _ramp(self, k_from: float, k_to: float, direction: int) -> Piece:
        sharpness = math.copysign(self.root * self.root, k_to - k_from)
        return Piece(abs(k_to - k_from) / self.root, k_from * self.root, sharpness, direction)
