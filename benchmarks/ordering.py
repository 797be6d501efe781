"""Ordering against OR-Tools and PyVRP: the same matrix, the same seconds.

Every segment can be painted in either direction, for which the peers have their means: OR-Tools a disjunction of both
directions, PyVRP a group of mutually exclusive clients. They are optional: `pip install .[bench]`.

    python -m benchmarks ordering seconds=2 only=random-60
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks._settings import Small
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Budget
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.sequencing.costs import NEVER_S, problem
from touchline.services.planner.sequencing.order import Problem, ordered
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths

# Seeds and sizes of the random instances; they are the same on every machine.
RANDOM = ((25, 1), (60, 2), (150, 3), (300, 4), (500, 5))
SCALE = 1000
SMALL = Small(
    {"seconds": 0.1, "only": "random-25"},
    ("cost after # s ours OR-Tools PyVRP", "random-25 #"),
)


def random_lines(count: int, seed: int) -> Problem:
    """Lines of 2 to 12 m, strewn over a square of 100 m; the cost is the straight distance in metres."""
    rng = np.random.default_rng(seed)
    ends = rng.random((count, 2)) * 100.0
    angle, length = rng.random(count) * 2.0 * np.pi, 2.0 + 10.0 * rng.random(count)
    others = ends + length[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    begin, end = np.concatenate((ends, others)), np.concatenate((others, ends))
    cost = np.zeros((2 * count + 1, 2 * count + 1))
    cost[:-1, :-1] = np.linalg.norm(end[:, None] - begin[None], axis=2)
    segment = np.tile(np.arange(count), 2)
    cost[:-1, :-1][segment[:, None] == segment[None, :]] = NEVER_S
    return Problem(cost, segment, (np.arange(2 * count) + count) % (2 * count))


def of_template(name: str) -> Problem:
    """The matrix of times of a shipped template, circles begun where they are given."""
    vehicle, options = Vehicle(), PlanOptions()
    limits = Limits.of(vehicle, options)
    painting = Painting.of(vehicle, limits, options)
    choices = swaths(modes(load_template(name).segments, vehicle, limits.curvature_max_1pm), painting, free=True)
    return problem(choices, transitions_of(vehicle, options, limits), painting, None)[0]


def instances() -> dict[str, Callable[[], Problem]]:
    """Name and maker of every instance."""
    found: dict[str, Callable[[], Problem]] = {"soccer-11": lambda: of_template("soccer-11")}
    for count, seed in RANDOM:
        found[f"random-{count}"] = partial(random_lines, count, seed)
    return found


def ours(asked: Problem, seconds: float) -> float:
    """Cost of our order after a number of seconds."""
    end = time.perf_counter() + seconds
    return asked.cost_of(ordered(asked, Budget(enough=lambda: time.perf_counter() > end), int(200_000 * seconds)))


def ortools(asked: Problem, seconds: float) -> float:
    """OR-Tools' routing with guided local search, the directions of a segment in a disjunction."""
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    depot = len(asked.segment)
    matrix = np.rint(np.minimum(asked.cost, NEVER_S) * SCALE).astype(np.int64).tolist()
    manager = pywrapcp.RoutingIndexManager(depot + 1, 1, depot)
    routing = pywrapcp.RoutingModel(manager)
    transit = routing.RegisterTransitMatrix(matrix)
    routing.SetArcCostEvaluatorOfAllVehicles(transit)
    for k in range(asked.segments):
        nodes = [manager.NodeToIndex(int(i)) for i in np.flatnonzero(asked.segment == k)]
        routing.AddDisjunction(nodes, int(NEVER_S) * SCALE * 10, 1)
    parameters = pywrapcp.DefaultRoutingSearchParameters()
    parameters.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    parameters.local_search_metaheuristic = routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    parameters.time_limit.FromMilliseconds(int(1000 * seconds))
    solution = routing.SolveWithParameters(parameters)
    nodes, index = [], solution.Value(routing.NextVar(routing.Start(0)))
    while not routing.IsEnd(index):
        nodes.append(manager.IndexToNode(index))
        index = solution.Value(routing.NextVar(index))
    return checked(asked, nodes)


def pyvrp(asked: Problem, seconds: float) -> float:
    """PyVRP's iterated local search, the directions of a segment in a client group."""
    from pyvrp import Client, ClientGroup, Depot, Location, ProblemData, VehicleType, solve
    from pyvrp.stop import MaxRuntime

    depot = len(asked.segment)
    order = [depot, *range(depot)]
    matrix = np.rint(asked.cost[np.ix_(order, order)] * SCALE).astype(np.int64)
    np.fill_diagonal(matrix, 0)
    clients = [Client(i + 1, required=False, group=int(k)) for i, k in enumerate(asked.segment)]
    groups = [ClientGroup([int(i) for i in np.flatnonzero(asked.segment == k)]) for k in range(asked.segments)]
    places = [Location(0, 0) for _ in order]
    data = ProblemData(places, clients, [Depot(0)], [VehicleType(1)], [matrix], [np.zeros_like(matrix)], groups)
    best = solve(data, stop=MaxRuntime(seconds), seed=1, display=False).best
    nodes = [stop.idx for route in best.routes() for stop in route.schedule() if stop.is_client()]
    return checked(asked, nodes)


def checked(asked: Problem, nodes: list[int]) -> float:
    """The cost of a peer's answer, by our matrix."""
    if sorted(asked.segment[nodes].tolist()) != list(range(asked.segments)):
        raise ValueError("not every segment is painted once")
    return asked.cost_of(np.array(nodes))


def main(seconds: float = 2.0, only: str = "") -> None:
    """Print what each solver reaches on each instance, or those whose name begins with `only`."""
    ordered(random_lines(5, 0), kicks=10)
    print(f"cost after {seconds:g} s" + "".join(f"{name:>14}" for name in ("ours", "OR-Tools", "PyVRP")))
    for name, make in instances().items():
        if not name.startswith(only):
            continue
        cells = []
        for solver in (ours, ortools, pyvrp):
            try:
                cells.append(f"{solver(make(), seconds):.2f}")
            except ImportError:
                cells.append("not here")
        print(f"{name:<16}" + "".join(f"{cell:>14}" for cell in cells), flush=True)
