"""Checks of what plug-ins return to the planner, before anything is computed from it.

Compiled kernels do not check their arguments; NaN or a wrong shape would make them write out of bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

from touchline.schemas.errors import PlanningError, TouchlineError
from touchline.schemas.plain_text import plain
from touchline.schemas.plugins import Registry, log_plugin_error
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

MISSED_M: Final = 1e-3
"""Tolerance for the end of a path; a larger distance from the goal is an error."""
MISSED_RAD: Final = 1e-3
_MOST_PIECES: Final = 10_000
_LONGEST: Final = 200

T = TypeVar("T")
Blame = Callable[[str], PlanningError]
"""Creates the error that names a plug-in from the problem with what it returned."""


def blaming(registry: Registry[Any], name: str) -> Blame | None:
    """Return the `Blame` of a plug-in by name ("": the default one); None if it is shipped, and trusted."""
    if registry.is_shipped(name or registry.default):
        return None

    def blame(problem: str) -> PlanningError:
        shown = plain(problem, _LONGEST)
        return PlanningError("", f"cannot use {registry.described(name)}: {shown}", "mend it, or use another one")

    return blame


def called(blame: Blame, function: Callable[..., T], *given: Any) -> T:
    """Call a function of the plug-in.

    Raises:
        PlanningError: The function raises any exception.
    """
    try:
        return function(*given)
    except TouchlineError:
        raise
    except Exception as error:  # whatever somebody else's code does
        blamed = blame(f"it fails with {type(error).__name__}: {error}")
        log_plugin_error(str(blamed))
        raise blamed from error


def sound(pieces: Any, blame: Blame) -> tuple[Piece, ...]:
    """Return the pieces, if a robot can drive each of them.

    Raises:
        PlanningError: A piece cannot be driven.
    """
    if not (isinstance(pieces, Sequence) and all(isinstance(each, Piece) for each in pieces)):
        raise blame(f"it gave a {type(pieces).__name__} instead of pieces of path")
    if len(pieces) > _MOST_PIECES:
        raise blame(f"it gave {len(pieces)} pieces for one path")
    for each in pieces:
        usable = all(map(math.isfinite, each)) and each.length_m >= 0.0 and each.direction in (1, -1)
        if not usable or (each.spin_rad and each.length_m):
            raise blame(f"it gave a piece of path with {each._asdict()}")
    return tuple(pieces)


def leading(pieces: Any, start: PathPose, goal: PathPose, blame: Blame) -> tuple[Piece, ...]:
    """Return the sound pieces, if they lead from start to goal; a goal with heading NaN may have any.

    Raises:
        PlanningError: The pieces do not lead there.
    """
    driven = sound(pieces, blame)
    if not all(map(math.isfinite, start)):
        raise blame(f"its path begins at {tuple(start)}")
    end = PiecePath(start, driven).end
    missed_m = abs(end.point - goal.point)
    missed_rad = 0.0 if math.isnan(goal.heading_rad) else math.remainder(end.heading_rad - goal.heading_rad, math.tau)
    if not (missed_m <= MISSED_M and abs(missed_rad) <= MISSED_RAD):
        raise blame(f"its path ends {missed_m:.3g} m and {abs(missed_rad):.3g} rad from its goal")
    return driven
