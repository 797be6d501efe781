"""Lower bounds of any planner's time: straight hops in any order, and turns at the wheels' speed in the given one."""

import math

import numpy as np

from touchline.schemas.messages import PlanOptions
from touchline.services.planner.drives.planned_drive import planned_drive
from touchline.services.planner.limits import Limits
from touchline.services.planner.sequencing.costs import NEVER_S, nodes_of
from touchline.services.planner.sequencing.order import Problem, ordered
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths
from touchline_research.driven_template import STUDY_SPEED_MPS, UNPADDED
from touchline_research.pitch import Pitch


def straight_hops_s(pitch: Pitch) -> float:
    """Seconds for the best order found, with straight hops from each line's end to the next one's start.

    Lines are painted at 1.5 m/s in either direction, circles from any point, hops driven at the wheels' limit. The
    optimum of this is a lower bound; the returned value is at or just above it.
    """
    limits = Limits.of(pitch.vehicle, PlanOptions())
    painting = Painting(limits)
    choices = modes(pitch.template.segments, pitch.vehicle, limits.drive.curvature_max_1pm, free=True)
    nodes, segment, flip = nodes_of(swaths(choices, painting, free=True))
    begin = np.array([node.begin.pose.point for node in nodes])
    end = np.array([node.end.pose.point for node in nodes])
    cost = np.zeros((len(nodes) + 1, len(nodes) + 1))
    cost[:-1, :-1] = np.abs(begin[None, :] - end[:, None]) / limits.drive.max_speed_mps
    cost[:-1, :-1][segment[:, None] == segment[None, :]] = NEVER_S
    cost[:, :-1] += [node.length_m / STUDY_SPEED_MPS for node in nodes]
    problem = Problem(cost, segment, flip)
    return problem.cost_of(ordered(problem))


def turning_bound_s(pitch: Pitch) -> float:
    """Lower bound (s) in the given order within κ_max = 1.125 1/m and the wheels' speed.

    `PlannedDrive.least_s` bounds the time of a path by its length and turn. No path is shorter than the plain Dubins
    path, and none turns by less than the headings differ. Lines are painted at 1.5 m/s.
    """
    driven = pitch.drive(UNPADDED)
    turned = (abs(math.remainder(w.end.heading_rad - w.start.heading_rad, math.tau)) for w in driven.transitions)
    fastest_s = planned_drive(pitch.vehicle).least_s(driven.transition_m, sum(turned))
    return driven.painted_m / STUDY_SPEED_MPS + fastest_s
