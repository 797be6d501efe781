"""Paths of legs: corners become turns without a stop where the body has room, else the robot turns on the spot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from touchline.services.planner.free_space.legs import Legs, WalledBody
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined
from touchline.services.planner.steering.turns import ContinuousTurn

# Corners beyond this (rad) are turned on the spot.
CORNER_MAX_RAD = 2.6
# Sampling of turns for checks of the body (m).
STEP_M = 0.05
# A straight this short (m) is left out beside a turn.
ROUNDING_M = 1e-9


def rounded(legs: Legs, turns: Sequence[ContinuousTurn], body: WalledBody) -> PiecePath:
    """Path of legs, with corners driven by the first of some turns that has room.

    Args:
        legs: The way.
        turns: Turns that the vehicle can drive, the quickest first.
        body: The body among walls.
    """
    places, lengths = legs.places, np.hypot(*np.diff(legs.places[:, :2], axis=0).T)
    spare = lengths.copy()
    corners: list[tuple[Piece, ...]] = [()] * len(places)
    heading = legs.start.heading_rad + np.cumsum(legs.turns_rad)
    for k in range(1, len(places) - 1):
        if places[k, 2] != places[k + 1, 2]:
            continue
        for pieces, tangent_m in _offers(legs.turns_rad[k], int(places[k, 2]), turns):
            # The next corner may have half of the straight between.
            room_m = min(spare[k - 1], (1.0 if k == len(places) - 2 else 0.5) * lengths[k])
            if tangent_m > room_m:
                continue
            back = -places[k, 2] * tangent_m
            begin = PathPose(
                float(places[k, 0] + back * math.cos(heading[k - 1])),
                float(places[k, 1] + back * math.sin(heading[k - 1])),
                float(heading[k - 1]),
            )
            if path_is_free(PiecePath(begin, pieces), body):
                corners[k] = pieces
                spare[k - 1] -= tangent_m
                spare[k] -= tangent_m
                break
    driven = [Piece.spin(float(legs.turns_rad[0]))]
    for k in range(1, len(places)):
        driven.append(Piece(max(float(spare[k - 1]), 0.0), direction=int(places[k, 2])))
        driven += corners[k] or (Piece.spin(float(legs.turns_rad[k])),)
    return PiecePath(legs.start, joined(each for each in driven if each.spin_rad or each.length_m > ROUNDING_M))


def path_is_free(path: PiecePath, body: WalledBody) -> bool:
    """True if the body can drive a path; its start is taken to be free."""
    for piece, knot in zip(path.pieces, path.knots, strict=False):
        bend = max(abs(piece.curvature_1pm), abs(piece.curvature_end_1pm))
        if piece.spin_rad or bend:
            step_rad = STEP_M / body.reach_m
            steps = math.ceil(max(abs(piece.spin_rad) / step_rad, piece.length_m / STEP_M))
        else:
            steps = 1
        if piece.spin_rad:
            turned = np.linspace(0.0, piece.spin_rad, steps + 1)
            poses = np.column_stack(np.broadcast_arrays(knot.x_m, knot.y_m, knot.heading_rad + turned))
            slack_m = STEP_M**2 / (8.0 * body.reach_m)
        else:
            x, y, heading, _ = PiecePath(knot, (piece,)).sample(np.linspace(0.0, piece.length_m, steps + 1))
            poses = np.column_stack((x, y, heading))
            slack_m = arc_slack_m(bend, body)
        if not body.sweeps(poses, slack_m):
            return False
    return True


def arc_slack_m(curvature_1pm: float, body: WalledBody) -> float:
    """Distance (m) of an arc from its chord of `STEP_M`, for every point of the body."""
    return STEP_M**2 * curvature_1pm * (1.0 + curvature_1pm * body.reach_m) / 8.0


def _offers(turn_rad: float, direction: int, turns: Sequence[ContinuousTurn]) -> list[tuple[tuple[Piece, ...], float]]:
    """Turns by an angle, and the length of the tangents that each takes off a corner (m)."""
    if not 0.0 < abs(turn_rad) < CORNER_MAX_RAD:
        return []
    offers = []
    for each in turns:
        pieces = each.pieces(abs(turn_rad))
        chord = abs(PiecePath(PathPose(0.0, 0.0, 0.0), pieces).end.point)
        # Backward, the heading turns to the left on a curve to the right.
        mirrored = (turn_rad < 0.0) != (direction < 0)
        driven = tuple((piece.mirrored() if mirrored else piece)._replace(direction=direction) for piece in pieces)
        offers.append((driven, 0.5 * chord / math.cos(0.5 * turn_rad)))
    return offers
