"""Row 14's corner: 3 m in, a right-hand quarter turn, 3 m out, at the study's speed, from rest to rest.

The corner is the same for every planner: two legs at right angles, with the distance of a quarter CC turn at the
study's κ_max and σ_max = 1.0. Before and after the legs the robot accelerates and brakes, which is not measured.
"""

import math

import numpy as np

from touchline.schemas.messages import Trajectory
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.output.message import trajectory_message
from touchline.services.planner.segments.section import Section
from touchline.services.planner.segments.sent_segments import send
from touchline.services.planner.speed.timing import SpeedProfile
from touchline.services.planner.steering.method import CurveEnd, transition
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline_research.driven_template import STUDY_KAPPA_1PM, STUDY_SPEED_MPS, Contestant

LEG_M = 3.0
RUN_M = 5.0
GAIN_MPS2 = 0.5
CORNER_SIGMA_1PM2 = 1.0
# Every arc that is sent steps in curvature; this tolerance (m) spares the wheels even if a follower passes them on.
FINE_M = 3e-6


def corner_path(contestant: Contestant, sigma_1pm2: float) -> PiecePath:
    """Path of the legs with the contestant's transition between them, without run-up and run-out."""
    turn = ContinuousTurn(STUDY_KAPPA_1PM, CORNER_SIGMA_1PM2)
    apart = turn.centre.real + turn.centre.imag
    start, goal = PathPose(0.0, 0.0, 0.0), PathPose(apart, -apart, -0.5 * math.pi)
    method = contestant.method(STUDY_KAPPA_1PM, sigma_1pm2)
    path = transition(method, CurveEnd(start, 0.0), CurveEnd(goal, 0.0))
    return PiecePath(PathPose(-LEG_M, 0.0, 0.0), (Piece(LEG_M), *path.pieces, Piece(LEG_M)))


def corner_trajectory(
    contestant: Contestant, sigma_1pm2: float, tolerance_m: float = FINE_M, run_m: float = RUN_M
) -> tuple[Trajectory, tuple[float, float]]:
    """Trajectory that the robot is sent, and the interval of arc length (m) of legs and corner.

    The robot accelerates and brakes over `run_m` before and after them.
    Clothoids are sent as arcs for every planner: the emulated robot refuses the kinks of the study's straight lines.
    """
    corner = corner_path(contestant, sigma_1pm2)
    first = corner.start._replace(x_m=corner.start.x_m - run_m)
    whole = PiecePath(first, (Piece(run_m), *corner.pieces, Piece(run_m)))
    sent = send([Section("corner", whole)], lambda fraction: None, tolerance_m)
    length = sent[-1].end_m
    run = STUDY_SPEED_MPS**2 / (2.0 * GAIN_MPS2)
    station = np.array([0.0, run, length - run, length])
    speeds = SpeedProfile(station, np.array([0.0, STUDY_SPEED_MPS, STUDY_SPEED_MPS, 0.0]))
    return trajectory_message(sent, speeds, []), (run_m, length - run_m)
