"""Projection on the path: arc length, cross-track and heading error, and the path ahead; one kernel call per tick.

Progress is an arc length that only moves in the commanded direction (along the plan, or back when the robot returns to
where paint stopped) and only as far as the robot can have moved in a tick: at a crossing the projection cannot jump to
the other branch. The kernel sees one leg at a time, which ends where the robot stands and changes direction. Headings
are the robot's: on a leg driven backward the path runs opposite to them.

By default the reference is where the robot is. For a timed follower it moves by the plan's time instead while the plan
is driven (`timed_reference`), but waits for a robot that is far from it; while the robot brakes, goes back, has
limited authority or slows down for something in its way, it is where the robot is.

The robot may drive up to its authority, which others extend; it comes to rest there as it does at a leg's end.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import Computer, LegState
from touchline.onboard.filter_model import EAST, HEADING, NORTH, RING
from touchline.onboard.interface import TICK_S
from touchline.onboard.trajectory.smoothing import W_CURVATURE, W_LENGTH, W_SHARPNESS, W_START
from touchline.onboard.trajectory.timed_reference import Reference, errors_against, run_on

Floats = NDArray[np.float64]

# Mode of the reference speed.
MODE_PROFILE: Final = 0
MODE_BRAKE: Final = 1
MODE_BACK: Final = 2

# Columns of the path ahead, which has one row for each of the next ticks.
A_SPEED: Final = 0  # reference speed, mean over the tick, signed [m/s]
A_YAW_RATE: Final = 1  # at which the path turns at that speed, mean over the tick [rad/s]
AHEAD_COLUMNS: Final = 2


class LegArrays(NamedTuple):
    """Arrays of a leg of the path.

    Attributes:
        pieces: (n, COLUMNS) of `smoothing.smooth_leg`.
        speeds: (m, 2) of `LoadedTrajectory`.
        ahead: (k, AHEAD_COLUMNS) path ahead.
    """

    pieces: Floats
    speeds: Floats
    ahead: Floats


COARSE_TICKS: Final = 4

CREEP_MPS: Final = 0.05
"""Reference speed where the profile is zero but the leg is not done: a start from 0, the last centimetres."""
MAX_AHEAD_M: Final = 0.5
"""Distance along the robot's axis beyond which a timed reference waits for the robot."""
_MAX_STEP_M = 0.05  # of progress in a tick
_HARD_BRAKE_MPS2 = 3.0
_GAUSS_NEAR = 0.5 - 0.5 / math.sqrt(3.0)
_GAUSS_FAR = 0.5 + 0.5 / math.sqrt(3.0)


@kernel
def piece_at(pieces: Floats, piece: int, s: float) -> int:
    """Find the piece at an arc length, searching from another piece; beyond an end it is the last one there.

    Args:
        pieces: (n, COLUMNS) of `smoothing`.
        piece: Piece at which the search begins.
        s: Arc length, m.
    """
    while piece + 1 < pieces.shape[0] and s >= pieces[piece + 1, W_START]:
        piece += 1
    while piece > 0 and s < pieces[piece, W_START]:
        piece -= 1
    return piece


@kernel
def _heading(pieces: Floats, piece: int, s: float) -> float:
    """Return the robot's heading on a piece, unwrapped."""
    u = s - pieces[piece, W_START]
    heading: float = pieces[piece, 2] + (pieces[piece, W_CURVATURE] + 0.5 * pieces[piece, W_SHARPNESS] * u) * u
    return heading


@kernel
def pose_on(pieces: Floats, sense: float, piece: int, s: float) -> tuple[float, float, float]:
    """Compute the point and the robot's heading at an arc length; beyond an end the leg is extended straight.

    A clothoid is integrated by the two-point Gauss rule ("NIST Digital Library of Mathematical Functions", sec.
    3.5(v)): its pieces are short.

    Args:
        pieces: (n, COLUMNS) of `smoothing`.
        sense: +1 if the leg is driven forward, −1 if backward.
        piece: The piece that `s` is on; see `piece_at`.
        s: Arc length, m.

    Returns:
        East and north, map frame (m), and the heading, unwrapped (rad).
    """
    last = pieces.shape[0] - 1
    extra = 0.0
    end = pieces[last, W_START] + pieces[last, W_LENGTH]
    if s > end:
        extra, s = s - end, end
    elif s < pieces[0, W_START]:
        extra, s = s - pieces[0, W_START], pieces[0, W_START]
    u = s - pieces[piece, W_START]
    heading = _heading(pieces, piece, s)
    if pieces[piece, W_SHARPNESS] == 0.0:
        half = 0.5 * pieces[piece, W_CURVATURE] * u
        chord = sense * u * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        x = pieces[piece, 0] + chord * math.cos(heading - half)
        y = pieces[piece, 1] + chord * math.sin(heading - half)
    else:  # a short piece of a clothoid, by the two-point Gauss rule
        near = _heading(pieces, piece, s - _GAUSS_FAR * u)
        far = _heading(pieces, piece, s - _GAUSS_NEAR * u)
        x = pieces[piece, 0] + 0.5 * sense * u * (math.cos(near) + math.cos(far))
        y = pieces[piece, 1] + 0.5 * sense * u * (math.sin(near) + math.sin(far))
    extra *= sense
    return x + extra * math.cos(heading), y + extra * math.sin(heading), heading


@kernel
def _profile(speeds: Floats, entry: int, s: float) -> tuple[float, int]:
    """Return the profile speed at arc length `s`, and the entry of the profile there."""
    last = speeds.shape[0] - 2
    while entry < last and s >= speeds[entry + 1, 0]:
        entry += 1
    while entry > 0 and s < speeds[entry, 0]:
        entry -= 1
    span = speeds[entry + 1, 0] - speeds[entry, 0]
    part = min(max((s - speeds[entry, 0]) / span, 0.0), 1.0) if span > 0.0 else 1.0
    squared = speeds[entry, 1] ** 2 + part * (speeds[entry + 1, 1] ** 2 - speeds[entry, 1] ** 2)
    return math.sqrt(max(squared, 0.0)), entry


@kernel
def _next_speed(at: Reference, h: float, mode: int, speeds: Floats, state: LegState) -> tuple[float, int]:
    """Return the reference speed `h` seconds ahead, and the entry of the profile there."""
    v, s, entry = at
    if mode == MODE_BRAKE:
        return math.copysign(max(abs(v) - state.brake_mps2 * h, 0.0), v), entry
    if mode == MODE_BACK:
        left = s - state.back_to_m + v * h
        fastest = min(state.back_speed_mps, math.sqrt(2.0 * state.brake_mps2 * max(left, 0.0)))
        fastest = min(max(fastest, CREEP_MPS if left > 0.0 else 0.0), state.limit_mps)
        return -min(max(-v, 0.0) + state.accelerate_mps2 * h, fastest), entry
    ahead = s + max(v, 0.0) * h
    fastest, entry = _profile(speeds, entry, ahead)
    left = min(state.pieces_end_m, state.authority_m) - ahead
    fastest = min(fastest, math.sqrt(2.0 * state.brake_mps2 * max(left, 0.0)))
    fastest = min(max(fastest, CREEP_MPS if left > 0.0 else 0.0), state.limit_mps)
    fastest = max(fastest, v - _HARD_BRAKE_MPS2 * h)
    return min(max(v, 0.0) + state.accelerate_mps2 * h, fastest), entry


@kernel
def track(computer: Computer, leg: LegArrays, sense: float, mode: int) -> None:
    """Project the estimated pose, step the reference speed and look ahead.

    Args:
        computer: (1,) progress, errors and references in its `leg` are filled in.
        leg: Arrays of the leg; its path ahead is filled in.
        sense: +1 if the leg is driven forward, −1 if backward.
        mode: MODE_PROFILE, MODE_BRAKE or MODE_BACK.
    """
    pieces, speeds, _ = leg
    state, slot = computer[0].leg, computer[0].times.tick % RING
    pose = computer[0].filter.states[slot]
    east, north, heading = pose[EAST], pose[NORTH], pose[HEADING]
    now = state.now
    before = state.arc_m
    piece = state.piece
    end = state.pieces_end_m
    back = mode == MODE_BACK or (mode == MODE_BRAKE and state.speed_mps < 0.0)
    low, high = (before - _MAX_STEP_M, before) if back else (before, before + _MAX_STEP_M)
    low, high = max(low, pieces[0, W_START]), min(high, end)
    s = before
    for _ in range(3):
        x, y, theta = pose_on(pieces, sense, piece, s)
        cos, sin = math.cos(theta), math.sin(theta)
        along = sense * ((east - x) * cos + (north - y) * sin)
        lateral = (north - y) * cos - (east - x) * sin
        stretch = min(max(1.0 - sense * pieces[piece, W_CURVATURE] * lateral, 0.5), 2.0)
        s = min(max(s + along / stretch, low), high)
        piece = piece_at(pieces, piece, s)
    x, y, theta = pose_on(pieces, sense, piece, s)
    cos, sin = math.cos(theta), math.sin(theta)
    lateral = (north - y) * cos - (east - x) * sin
    error = wrapped(heading - theta)
    state.arc_m = s
    state.piece = piece

    speed_before = state.speed_mps
    by_time = state.timed and mode == MODE_PROFILE and math.isinf(state.authority_m) and math.isinf(state.limit_mps)
    if by_time:
        reference = _by_time(speeds, state)
    else:
        v, entry = _next_speed(Reference(state.speed_mps, s, state.entry), TICK_S, mode, speeds, state)
        reference = Reference(v, s, entry)
        state.owed_s = 0.0
    state.speed_mps, state.reference_m, state.entry = reference
    now[tracking.LATERAL] = lateral
    now[tracking.HEADING_ERROR] = error
    now[tracking.NOZZLE_LATERAL] = (
        lateral + state.nozzle_x_m * math.sin(error) + state.nozzle_y_m * (math.cos(error) - 1.0)
    )
    now[tracking.REFERENCE_SPEED] = sense * reference.speed_mps
    if state.timed:
        now[tracking.REFERENCE_ACCELERATION] = sense * (reference.speed_mps - speed_before) / TICK_S
        piece = piece_at(pieces, piece, reference.arc_m)
        at = pose_on(pieces, sense, piece, reference.arc_m)
        theta = at[2]
        seen = errors_against((east, north, heading), at)
        now[tracking.ALONG], now[tracking.ACROSS], now[tracking.TURN] = seen
    if by_time:
        _look_ahead_by_time(leg, sense, reference, (piece, theta), state)
    else:
        _look_ahead(leg, sense, mode, reference, (piece, theta), state)


@kernel
def _look_ahead(
    leg: LegArrays, sense: float, mode: int, reference: Reference, place: tuple[int, float], state: LegState
) -> None:
    """Fill in the path ahead from the robot's place: its piece and the heading there."""
    pieces, speeds, ahead = leg
    v, s, entry = reference
    piece, theta = place
    for i in range(ahead.shape[0]):
        h = TICK_S if i < state.fine_rows else COARSE_TICKS * TICK_S
        v_next, entry = _next_speed(Reference(v, s, entry), h, mode, speeds, state)
        mean = 0.5 * (v + v_next)
        ahead[i, A_SPEED] = sense * mean
        s = min(max(s + mean * h, pieces[0, W_START]), state.pieces_end_m)
        piece = piece_at(pieces, piece, s)
        theta_next = _heading(pieces, piece, s)
        ahead[i, A_YAW_RATE] = (theta_next - theta) / h
        theta, v = theta_next, v_next


@kernel
def _by_time(speeds: Floats, state: LegState) -> Reference:
    """Move a timed reference by this tick; time that it cannot use is owed."""
    at = Reference(state.speed_mps, state.reference_m, state.entry)
    if abs(state.now[tracking.ALONG]) > MAX_AHEAD_M:
        state.owed_s = 0.0
        return Reference(0.0, at.arc_m, at.entry)
    time_s = TICK_S + state.owed_s
    state.owed_s = 0.0
    if time_s > 0.0:
        at, state.owed_s = run_on(speeds, at, _end_m(state), state.accelerate_mps2, time_s)
    return at


@kernel
def _end_m(state: LegState) -> float:
    """Return the arc length at which a timed reference ends."""
    end_m: float = min(state.end_m, state.pieces_end_m)
    return end_m


@kernel
def _look_ahead_by_time(
    leg: LegArrays, sense: float, reference: Reference, place: tuple[int, float], state: LegState
) -> None:
    """Fill in the path ahead from a timed reference's place: its piece and the heading there."""
    pieces, speeds, ahead = leg
    piece, theta = place
    for i in range(ahead.shape[0]):
        h = TICK_S if i < state.fine_rows else COARSE_TICKS * TICK_S
        before_m = reference.arc_m
        reference, _ = run_on(speeds, reference, _end_m(state), state.accelerate_mps2, h)
        piece = piece_at(pieces, piece, reference.arc_m)
        theta_next = _heading(pieces, piece, reference.arc_m)
        ahead[i, A_SPEED] = sense * (reference.arc_m - before_m) / h
        ahead[i, A_YAW_RATE] = (theta_next - theta) / h
        theta = theta_next
