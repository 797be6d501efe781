"""OMPL as a peer: sampling-based searches of a car among walls, with the product's check of its body.

It runs in a process of its own: now and then its Python bindings end theirs with a segmentation fault.
"""

from __future__ import annotations

import math
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from importlib.util import find_spec
from multiprocessing import get_context
from typing import Final, NamedTuple, Self

import numpy as np
import shapely

from touchline.services.planner.free_space.legs import WalledBody
from touchline.services.planner.geometry.clothoid import Floats, PathPose

INSTALL: Final = "OMPL is not installed, its rows are left out: pip install './research[peers]'."
STEP_M: Final = 0.02
"""Distance of the poses that are checked."""
TRIES: Final = 5
"""Processes that may end in one search."""
SIMPLIFIED_S: Final = 1.0
"""Time after which the simplification of a way ends."""


class FoundWay(NamedTuple):
    """Way that a planner found.

    Attributes:
        length_m: Length, turns on the spot not counted.
        seconds: Time of the processor.
        places: (n, 2) x and y along it (m).
        free: False if the body grazes a wall between the poses that the planner has checked.
    """

    length_m: float
    seconds: float
    places: Floats
    free: bool = True


def has_ompl() -> bool:
    """True if OMPL is installed."""
    return find_spec("ompl") is not None


class OmplProcess:
    """Process that searches; a context manager."""

    def __init__(self) -> None:
        """Start it with the first search."""
        self._pool = _pool()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()

    def way(
        self, body: WalledBody, radius_m: float, planner: str, ends: tuple[PathPose, PathPose], seconds: float
    ) -> FoundWay | None:
        """Search as `search_way` does, again if the process has ended.

        Raises:
            BrokenProcessPool: It has ended TRIES times.
        """
        ended = 0
        while True:
            try:
                return self._pool.submit(search_way, body, radius_m, planner, ends, seconds).result()
            except BrokenProcessPool:
                ended += 1
                if ended == TRIES:
                    raise
                self._pool = _pool()


def _pool() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, get_context("spawn"))


def search_way(
    body: WalledBody, radius_m: float, planner: str, ends: tuple[PathPose, PathPose], seconds: float
) -> FoundWay | None:
    """Search for a way of a car that drives forward and backward (Reeds and Shepp), and simplify it.

    Args:
        body: The body among walls.
        radius_m: Turning radius.
        planner: Name of a class of `ompl.geometric`.
        ends: Start and goal.
        seconds: Time after which the search ends; planners that find one way only end with that.

    Returns:
        The way; None if none was found.
    """
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_ERROR)
    space, bounds = base.ReedsSheppStateSpace(radius_m), base.RealVectorBounds(2)
    west, south, east, north = body.ground.free.bounds
    for axis, (low, high) in enumerate(((west, east), (south, north))):
        bounds.setLow(axis, low)
        bounds.setHigh(axis, high)
    space.setBounds(bounds)
    known = base.SpaceInformation(space)
    shapely.prepare(body.ground.free)
    known.setStateValidityChecker(lambda state: body.stands_free(PathPose(state.getX(), state.getY(), state.getYaw())))
    known.setStateValidityCheckingResolution(STEP_M / space.getMaximumExtent())
    known.setup()
    problem, states = base.ProblemDefinition(known), []
    for pose in ends:
        state = known.allocState()
        state.setX(pose.x_m)
        state.setY(pose.y_m)
        state.setYaw(math.remainder(pose.heading_rad, math.tau))
        states.append(state)
    problem.setStartAndGoalStates(*states)
    problem.setOptimizationObjective(base.PathLengthOptimizationObjective(known))
    search = getattr(geometric, planner)(known)
    if planner == "BITstar":
        # Each sample that it prunes may rebuild its index of neighbours, which in this space takes minutes.
        search.setPruning(False)
    search.setProblemDefinition(problem)
    search.setup()
    begun = time.process_time()
    search.solve(seconds)
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    geometric.PathSimplifier(known).simplify(path, SIMPLIFIED_S)
    spent, length_m = time.process_time() - begun, float(path.length())
    path.interpolate(max(2, math.ceil(length_m / STEP_M)))
    poses = np.array([(each.getX(), each.getY(), each.getYaw()) for each in path.getStates()])
    return FoundWay(length_m, spent, poses[:, :2], body.sweeps(poses, 0.0))
