"""The order and direction in which the segments are painted: as given, or so that the whole takes least time."""

from collections.abc import Callable, Sequence

from schemas.errors import PlanningError
from schemas.messages import PlanOptions
from services.planner.clothoid import Pose
from services.planner.method import CurveEnd
from services.planner.offset import Stroke
from services.planner.ways import Ways

GIVEN, OPTIMISED = "given", "optimised"


def ordering(options: PlanOptions) -> bool:
    """Whether the options ask for an order that takes least time.

    Raises:
        PlanningError: They ask for something else.
    """
    if options.order not in ("", GIVEN, OPTIMISED):
        raise PlanningError("", f'asks for the unknown order "{options.order}"', f"use {OPTIMISED} or {GIVEN}")
    return options.order != GIVEN


def arranged(
    modes: Sequence[Sequence[Stroke]],
    ways: Ways,
    start: Pose | None,
    options: PlanOptions,
    step: Callable[[float], None],
    enough: Callable[[], bool],
) -> list[Stroke]:
    """One mode of every segment, in painting order."""
    if not ordering(options):
        step(1.0)
        return [choice[0] for choice in modes]
    from services.planner.order import ordered
    from services.planner.order_costs import nodes_of, problem

    nodes, _, _ = nodes_of(modes)
    asked = problem(modes, ways, CurveEnd(start, 0.0) if start else None)
    return [nodes[k] for k in ordered(asked, step, enough).tolist()]
