"""Random things on a field that no plan knows: a third of them move, at walking speed."""

import math
from typing import Any, Final

import numpy as np

from touchline.schemas.scenario_objects import ScenarioObject

STANDING: Final = ("post", "tree", "bench", "machine", "goal", "wall", "person", "ball")
MOTIONS, SHARES = ("wander", "path", "step-in-front", "intercept"), (0.4, 0.3, 0.28, 0.02)
FEWEST, MOST = 5, 40
FASTEST_MPS: Final = 1.4
"""Below the speed of things that protection counts on."""
CLEAR_M: Final = 2.0
"""Distance from the robot's start within which nothing is at first."""
Box = tuple[float, float, float, float]


def random_things(rng: np.random.Generator, box: Box, start: tuple[float, float]) -> tuple[ScenarioObject, ...]:
    """Draw things.

    Args:
        rng: Generator.
        box: x and y of the south-west corner, and of the north-east one (m).
        start: x and y of the robot's start (m).
    """
    wanted, things = int(rng.integers(FEWEST, MOST + 1)), list[ScenarioObject]()
    while len(things) < wanted:
        x, y = rng.uniform(box[0], box[2]), rng.uniform(box[1], box[3])
        place: dict[str, Any] = {"x_m": x, "y_m": y, "heading_rad": rng.uniform(-math.pi, math.pi)}
        moves = len(things) % 3 == 0
        kind = str(rng.choice(("person", "dog"))) if moves else str(rng.choice(STANDING))
        thing = ScenarioObject.model_validate(
            {"kind": kind, **place, **({"motion": _motion(rng, box, (x, y))} if moves else {})}
        )
        if math.hypot(x - start[0], y - start[1]) > CLEAR_M + _reach_m(thing):
            things.append(thing)
    return tuple(things)


def _reach_m(thing: ScenarioObject) -> float:
    """Return the largest distance of a thing's outline from its place."""
    return max((math.hypot(*corner) for corner in thing.outline_m), default=thing.disc_m)


def _motion(rng: np.random.Generator, box: Box, place: tuple[float, float]) -> dict[str, Any]:
    kind = str(rng.choice(MOTIONS, p=SHARES))
    speed = {"speed_mps": float(rng.uniform(0.4, FASTEST_MPS))}
    if kind == "wander":
        return {"kind": kind, "corner": box[:2], "opposite": box[2:], **speed}
    if kind == "path":
        points = np.clip(rng.normal(place, 10.0, (3, 2)), box[:2], box[2:])
        return {"kind": kind, "points": points.tolist(), "loop": True, "start_s": rng.uniform(0.0, 200.0), **speed}
    return {"kind": kind, **speed}
