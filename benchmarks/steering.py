"""Steering: microseconds a query, a million pairs built and verified, and the reference rows.

`python -m benchmarks steering`; `side` is that of the matrix of queries, `pairs` are verified, of the reference rows
every `nth` is compared.
"""

import csv
import math
import time
from pathlib import Path

import numpy as np

from benchmarks._settings import Small
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import NODES, WEIGHTS, Floats, PathPose, PiecePath
from touchline.services.planner.steering.circles import circle
from touchline.services.planner.steering.construct import MAX_PIECES, forward_pieces
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.query import Query
from touchline.services.planner.steering.word_lengths import word_lengths

ROWS = Path(__file__).parents[1] / "tests" / "planner" / "data" / "steering_lengths.csv"
CURVATURE_1PM, SHARPNESS_1PM2 = 1.125, 2.1
# What steering_functions' CC00-Dubins takes a query, as quoted for a machine like this one.
QUOTED_US = (1.0, 1.4)
CHUNK = 50_000
ENDS_TOLERANCE = LIMIT_TOLERANCE = 1e-9
# Panels short enough for sixteen nodes, whatever the piece.
PANEL_RAD = 2.0
GROUPS = {
    "κ 1.125, σ 1.0, 10 m": (0, 2000),
    "κ 1.125, σ 2.1, 10 m": (2000, 3000),
    "κ 1.3126, σ 7, 10 m": (3000, 4000),
    "κ 1.125, σ 1.0, 2.5 m": (4000, 5000),
    "once missed": (5000, 5031),
    "κ 0.5 to 2, σ 0.3 to 10": (5031, 5130),
}
"""First and last of the reference rows of each kind."""
SMALL = Small(
    {"side": 10, "pairs": 1000, "nth": 100},
    (
        "one query in a matrix, κ # 1/m, σ # 1/m²:",
        "# m box, bent ends: # µs, # words in # s (#–# of CC00's quoted)",
        *(f"{kind} forward #, # with cusps #, #" for kind in GROUPS),
        "# pairs in a 10 m box, a fifth of them coincident or nearly, random end curvatures:",
        "# complete and feasible, # µs each to find, build and verify",
        "worst: position # m, heading # rad,",
        "curvature over its limit or stepping # 1/m, sharpness over its limit # 1/m²",
    ),
)


def main(side: int = 1000, pairs: int = 1_000_000, nth: int = 1) -> None:
    """Run the benchmark, and print its figures."""
    _queries(side)
    _reference_rows(nth)
    _million(pairs)


def _random_poses(rng: np.random.Generator, count: int, box_m: float, curvature_1pm: float) -> Floats:
    corner = (box_m, box_m, math.pi, curvature_1pm)
    return rng.uniform((0.0, 0.0, -math.pi, -curvature_1pm), corner, (count, 4))


def _queries(side: int) -> None:
    rng = np.random.default_rng(1)
    print(f"one query in a matrix, κ {CURVATURE_1PM} 1/m, σ {SHARPNESS_1PM2} 1/m²:")
    for box, bent in ((10.0, 0.0), (100.0, 0.0), (100.0, CURVATURE_1PM)):
        starts, goals = _random_poses(rng, side, box, bent), _random_poses(rng, side, box, bent)
        word_lengths(starts[:2], goals[:2], CURVATURE_1PM, SHARPNESS_1PM2)
        total = min(_seconds(starts, goals) for _ in range(3))
        took = total / side**2 * 1e6
        what = f"{took / QUOTED_US[0]:.2f}–{took / QUOTED_US[1]:.2f} of CC00's quoted"
        ends = "bent" if bent else "straight"
        print(f"  {box:5.0f} m box, {ends:8} ends: {took:8.3f} µs, {side**2:9,} words in {total:.2f} s ({what})")


def _seconds(starts: Floats, goals: Floats) -> float:
    begin = time.perf_counter()
    word_lengths(starts, goals, CURVATURE_1PM, SHARPNESS_1PM2)
    return time.perf_counter() - begin


def _reference_rows(nth: int) -> None:
    with ROWS.open() as file:
        rows = [{key: float(text) for key, text in row.items()} for row in csv.DictReader(file)]
    print("reference rows, length over that of steering_functions (mean, largest of any row):")
    for name, (first, last) in GROUPS.items():
        ours = np.array([_row_lengths(row) for row in rows[first:last:nth]])
        theirs = np.array([(row["cc00_dubins_m"], row["hc00_reeds_shepp_m"]) for row in rows[first:last:nth]])
        mean, largest = ours.mean(0) / theirs.mean(0), (ours / theirs).max(0)
        print(f"  {name:24} forward {mean[0]:.4f}, {largest[0]:.6f}   with cusps {mean[1]:.4f}, {largest[1]:.6f}")


def _row_lengths(row: dict[str, float]) -> tuple[float, float]:
    start = CurveEnd(PathPose(row["x0"], row["y0"], row["theta0"]), 0.0)
    goal = CurveEnd(PathPose(row["x1"], row["y1"], row["theta1"]), 0.0)
    steering = Steering(row["kappa_max"], row["sigma_max"])
    paths = [steering.between(start, goal), *steering.standing_transitions(start, goal)]
    driven = [PiecePath(start.pose, path).length_m for path in paths if not any(piece.spin_rad for piece in path)]
    return driven[0], min(driven)


def _million(pairs: int) -> None:
    rng = np.random.default_rng(2)
    root = math.sqrt(SHARPNESS_1PM2)
    c = circle(CURVATURE_1PM / root)
    complete, took, worst = 0, 0.0, np.zeros(4)
    for first in range(0, pairs, CHUNK):
        count = min(CHUNK, pairs - first)
        starts = _random_poses(rng, count, 10.0, CURVATURE_1PM)
        goals = _random_poses(rng, count, 10.0, CURVATURE_1PM)
        # Every tenth pair coincides but for its curvatures, every tenth differs by up to a micrometre to a decimetre.
        goals[::10, :3] = starts[::10, :3]
        near = 10.0 ** rng.uniform(-6.0, -1.0, (len(goals[1::10]), 1))
        goals[1::10, :3] = starts[1::10, :3] + near * rng.uniform(-1.0, 1.0, near.shape) * np.ones(3)
        # Half of all ends are straight.
        starts[rng.random(count) < 0.5, 3] = 0.0
        goals[rng.random(count) < 0.5, 3] = 0.0
        if not first:
            _verify(starts[:2], goals[:2], root, c, np.zeros(4))
        begin = time.perf_counter()
        complete += int(_verify(starts, goals, root, c, worst))
        took += time.perf_counter() - begin
    print(f"{pairs:,} pairs in a 10 m box, a fifth of them coincident or nearly, random end curvatures:")
    print(f"  {complete:,} complete and feasible, {took / pairs * 1e6:.1f} µs each to find, build and verify")
    print(f"  worst: position {worst[0]:.1e} m, heading {worst[1]:.1e} rad,")
    print(f"  curvature over its limit or stepping {worst[2]:.1e} 1/m, sharpness over its limit {worst[3]:.1e} 1/m²")


@kernel
def _verify(starts: Floats, goals: Floats, root: float, c: Floats, worst: Floats) -> int:
    """Number of pairs whose path is feasible; `worst` collects errors of position, heading, curvature and sharpness.

    The pieces are integrated by Gauss-Legendre quadrature, which shares nothing with the series that found them.
    """
    complete = 0
    pieces = np.empty((MAX_PIECES, 4))
    for row in range(len(starts)):
        s, g = starts[row], goals[row]
        ends = np.array([s[3], g[3]]) / root
        facing = complex(math.cos(s[2]), -math.sin(s[2]))
        goal = complex(g[0] - s[0], g[1] - s[1]) * facing * root
        n = forward_pieces(Query(ends, goal, g[2] - s[2], c), pieces)
        p, heading, k = 0j, 0.0, ends[0]
        over_k, over_sharpness = 0.0, 0.0
        for i in range(n):
            length, k_from, sharpness = pieces[i, 0], pieces[i, 1], pieces[i, 2]
            over_k = max(over_k, abs(k_from - k))
            k = k_from + sharpness * length
            over_k = max(over_k, abs(k) - c[0], abs(k_from) - c[0])
            over_sharpness = max(over_sharpness, abs(sharpness) - 1.0)
            turn = (abs(k_from) + 0.5 * abs(sharpness) * length) * length
            panels = 1 + int(turn / PANEL_RAD)
            h = length / panels
            for panel in range(panels):
                for node in range(len(NODES)):
                    at = (panel + NODES[node]) * h
                    angle = heading + (k_from + 0.5 * sharpness * at) * at
                    p += h * WEIGHTS[node] * complex(math.cos(angle), math.sin(angle))
            heading += (k_from + 0.5 * sharpness * length) * length
        over_k = max(over_k, abs(k - ends[1])) * root
        over_sharpness *= root * root
        off = abs(p - goal) / root
        difference = heading - (g[2] - s[2])
        turn_off = abs(math.atan2(math.sin(difference), math.cos(difference)))
        worst[0], worst[1] = max(worst[0], off), max(worst[1], turn_off)
        worst[2], worst[3] = max(worst[2], over_k), max(worst[3], over_sharpness)
        ends_meet = off < ENDS_TOLERANCE and turn_off < ENDS_TOLERANCE
        if ends_meet and over_k < LIMIT_TOLERANCE and over_sharpness < LIMIT_TOLERANCE:
            complete += 1
    return complete
