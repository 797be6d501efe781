"""What no planner can beat: straight hops at full speed in any order; turns at the wheels' speed in the given one."""

import math

import numpy as np

from touchline.schemas.messages import PlanOptions
from touchline.services.planner.limits import Limits
from touchline.services.planner.sequencing.costs import NEVER_S, nodes_of
from touchline.services.planner.sequencing.order import Problem, ordered
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths
from touchline.services.study.driven_template import STUDY_SPEED_MPS, UNPADDED
from touchline.services.study.pitch import Pitch


def straight_hops_s(pitch: Pitch) -> float:
    """Seconds for the best order found if the robot could hop straight from each line's end to the next one's start.

    Lines are painted at 1.5 m/s either way round, circles from anywhere, hops driven at the wheels' limit. No planner
    comes below the optimum of this; what is returned is at or just above it.
    """
    tightest = 1.0 / pitch.vehicle.half_track_m
    painting = Painting(Limits.of(pitch.vehicle, PlanOptions()))
    choices = modes(pitch.template.segments, pitch.vehicle, tightest, free=True)
    nodes, segment, flip = nodes_of(swaths(choices, painting, free=True))
    begin = np.array([node.begin.pose.point for node in nodes])
    end = np.array([node.end.pose.point for node in nodes])
    cost = np.zeros((len(nodes) + 1, len(nodes) + 1))
    cost[:-1, :-1] = np.abs(begin[None, :] - end[:, None]) / pitch.vehicle.max_rim_speed_mps
    cost[:-1, :-1][segment[:, None] == segment[None, :]] = NEVER_S
    cost[:, :-1] += [node.length_m / STUDY_SPEED_MPS for node in nodes]
    problem = Problem(cost, segment, flip)
    return problem.cost_of(ordered(problem))


def turning_bound_s(pitch: Pitch) -> float:
    """Seconds that nobody beats in the given order who keeps κ_max = 1.125 1/m and the wheels' speed.

    With the outer rim at v_w a robot drives v = v_w / (1 + |κ|·r), so a way of length L that turns by θ in all takes
    (L + r·θ) / v_w at least. None is shorter than the plain Dubins path, and none turns by less than the headings
    differ. Lines are painted at 1.5 m/s.
    """
    driven = pitch.drive(UNPADDED)
    rim, half_track = pitch.vehicle.max_rim_speed_mps, pitch.vehicle.half_track_m
    turned = (abs(math.remainder(w.end.heading_rad - w.start.heading_rad, math.tau)) for w in driven.ways)
    return driven.painted_m / STUDY_SPEED_MPS + (driven.transition_m + half_track * sum(turned)) / rim
