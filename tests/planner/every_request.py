"""Requests of every kind to a planner that is warm; prints the kernels that were not there by then or cannot be kept.

Run as `python -m tests.planner.every_request VEHICLE`, each time in a new process.
"""

import itertools
import json
import sys

import numpy as np

from tests.late_kernels import LateKernels, tell_of_numba
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PlanRequest, PoseGoal
from touchline.schemas.plugins import AREA_METHODS, METHODS, POSE_METHODS, SPEED_LAWS
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.request import answer
from touchline.services.planner.service import Worker

FIELD = {"boundary": {"corners": [(-40, -60), (80, -60), (80, 60), (-40, 60)]}}
POST = {"obstacles": [{"id": "post", "corners": [(12, 2), (14, 2), (14, 5), (12, 5)]}]}
LINES = [
    {"id": "bar", "line": {"start": (0, 0), "end": (10, 0)}},
    {"id": "on", "line": {"start": (16, 0), "end": (26, 0)}},
    {"id": "bow", "arc": {"start": (10, 0), "center": (10, -13), "sweep_angle": -1.5708}},
    {"id": "across", "line": {"start": (3, -20), "end": (3, 20)}},
]
OUTLINE = [(0, 0), (12, 0), (12, 9), (0, 9)]
HOLE = [(5, 4), (6, 4), (6, 5), (5, 5)]
WAYS = [
    {},
    {"order": "given"},
    {"forward_only": True},
    {"drying_time_s": 600.0},
    {"drying_time_s": 600.0, "hard_drying": True},
    {"start": np.array([0.0, -9.0, 0.0]), "return_to_start": True},
    {"start": np.array([0.0, -9.0, 0.0]), "end": np.array([0.0, -12.0, 1.0])},
    {"kappa_max_1pm": 0.2, "sigma_max_1pm2": 0.1},
]


def lines():
    """Every method with every way, and each of both with every ground."""
    for (i, method), (k, way) in itertools.product(enumerate(METHODS.names()), enumerate(WAYS)):
        more = ({}, FIELD, FIELD | POST)[(i + k) % 3]
        text = json.dumps({"name": "lines", "segments": LINES, **more})
        yield PlanRequest(template_json=text, options=PlanOptions(method=method, **way))


def areas(methods, width_m):
    """Some tens of widths of the tool across at most: more take long."""
    outline, hole = (np.array(each) * min(1.0, 2.0 * width_m) for each in (OUTLINE, HOLE))
    for more, method in itertools.product(({}, FIELD), methods):
        shape = [{"id": "area", "outline": outline.tolist(), "holes": [hole.tolist()]}]
        text = json.dumps({"name": "area", "areas": shape, **more})
        yield PlanRequest(template_json=text, options=PlanOptions(area_method=method, laps=0, coverage_pct=1.0))


def rest():
    """Half of an area, from where the robot stands in it."""
    text = json.dumps({"name": "area", "areas": [{"id": "area", "outline": OUTLINE}]})
    half = json.dumps({"pieces": [{"area": "area", "corners": [(6, 0), (12, 0), (12, 9), (6, 9)]}]})
    options = PlanOptions(start=np.array([3.0, 4.0, 0.0]), coverage_pct=1.0)
    yield PlanRequest(template_json=text, options=options, remaining_json=half)


def goals():
    """Every method to every kind of place, and with every law and a given time to the first."""
    first, *others = [(5.0, 2.0, 1.0), (0.3, 0.5, 2.0), (5.0, 2.0, np.nan), (-3.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    for method in POSE_METHODS.names():
        laws = [(first, law, seconds) for law in SPEED_LAWS.names() for seconds in (0.0, 60.0)]
        for (x, y, heading), law, seconds in (*((place, "", 0.0) for place in others), *laws):
            goal = PoseGoal(x_m=x, y_m=y, heading_rad=heading, method=method, law=law, duration_s=seconds)
            yield PlanRequest(goal=(goal,), options=PlanOptions(start=np.zeros(3)))


def goals_under_way(drive):
    for at_m, method in itertools.product((0.0, 3.0, 12.0), POSE_METHODS.names()):
        leaving = LeavingTrajectory(trajectory=drive, arc_length_m=at_m)
        yield PlanRequest(goal=(PoseGoal(x_m=30.0, y_m=-6.0, heading_rad=0.0, method=method),), leaving=(leaving,))


def main(name):
    tell_of_numba()
    vehicle = SHIPPED[name].vehicle
    Worker((vehicle,))._warm_up()
    late = LateKernels()
    far = PlanRequest(goal=(PoseGoal(x_m=25.0, y_m=6.0, heading_rad=0.0),), options=PlanOptions(start=np.zeros(3)))
    methods = AREA_METHODS.names() if vehicle.tool.width_m else ()
    rests = rest() if vehicle.tool.covers else ()
    planned = []
    under_way = goals_under_way(answer(far, vehicle).trajectory)
    for request in (*lines(), *areas(methods, vehicle.tool.width_m), *rests, *goals(), *under_way):
        late.doing = f"{request.template_json} {request.options} {request.goal}"
        planned.append(answer(request, vehicle).success)
    assert sum(planned) > len(planned) / 3, "most are refused, and show nothing"
    late.tell()


if __name__ == "__main__":
    main(*sys.argv[1:])
