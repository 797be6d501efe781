"""Domains of attraction of tracking laws: starts from which they reach their reference facing forward."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats
from touchline_research.target_table import TargetRow, TargetTable, against_targets
from touchline_research.tracking.tracker_runs import LAWS, SETTLED_M, looks_ahead, settled_after_s
from touchline_research.tracking.tracking_loop import (
    STUDIED,
    TimedReference,
    by_law,
    reference_of,
    track_reference,
)

DURATION_S: Final = 40.0
SPEED_MPS: Final = 0.15
FURTHEST_M: Final = 2.0
QUIET: Final = STUDIED._replace(position_m=0.0, heading_rad=0.0)
NEAR_M: Final = 0.05
OURS: Final = "regularised"


@dataclass(frozen=True)
class Domain:
    """Outcome of a law from a grid of starts.

    Attributes:
        turned_rad: (m,) initial headings relative to the reference's.
        across_m: (n,) initial lateral offsets, left positive.
        settled_s: (n, m) time until it stays within 2 cm; NaN: it never faces forward near the reference.
        reversed_there: (n, m) whether it ends near the reference, but facing backward.
    """

    turned_rad: Floats
    across_m: Floats
    settled_s: Floats
    reversed_there: np.ndarray[Any, np.dtype[np.bool_]]


def winding_reference() -> TimedReference:
    """Reference of constant speed that bends to either side."""
    return reference_of(lambda t: 0.0 * t + SPEED_MPS, lambda t: 0.06 * np.cos(0.5 * t), DURATION_S)


def domain_of(law: Any, headings: int, offsets: int) -> Domain:
    """Measure a law from headings all round and offsets up to FURTHEST_M to either side.

    Args:
        law: Tracking law.
        headings: Number of initial headings.
        offsets: Number of initial offsets.
    """
    reference = winding_reference()
    turned, across = np.linspace(-math.pi, math.pi, headings), np.linspace(-FURTHEST_M, FURTHEST_M, offsets)
    settled, back = np.full((offsets, headings), math.nan), np.zeros((offsets, headings), dtype=np.bool_)
    for i, left in enumerate(across.tolist()):
        for k, turn in enumerate(turned.tolist()):
            run = track_reference(by_law(law), reference, (0.0, left, turn), QUIET)
            there, ahead = run.distance_m[-1] <= NEAR_M, looks_ahead(run)
            back[i, k] = there and not ahead
            if there and ahead:
                settled[i, k] = settled_after_s(run)
    return Domain(turned, across, settled, back)


def domains(headings: int, offsets: int) -> dict[str, Domain]:
    """Measure every law."""
    return {name: domain_of(law, headings, offsets) for name, law in LAWS.items()}


def attraction(found: Mapping[str, Domain]) -> TargetTable:
    """Create the table of domains."""
    count = next(iter(found.values())).settled_s.size
    title = f"Domain of attraction: {count} starts, headings all round, up to {FURTHEST_M:g} m to either side"
    note = (
        f"A reference at {SPEED_MPS} m/s that bends to either side, {DURATION_S:g} s, the disturbances but for noise. "
        f"There is within {1e2 * NEAR_M:g} cm at the end; the mean time is that until {1e2 * SETTLED_M:g} cm are kept."
    )
    columns = ("tracker", "there, looking ahead", "there, looking back", "mean time")
    return TargetTable(title, columns, tuple(_row(name, domain) for name, domain in found.items()), note)


def _row(name: str, domain: Domain) -> TargetRow:
    count = domain.settled_s.size
    ahead, back = int(np.isfinite(domain.settled_s).sum()), int(domain.reversed_there.sum())
    seconds = float(np.nanmean(domain.settled_s)) if ahead else math.nan
    cells = (name, f"{ahead / count:.0%}", f"{back / count:.0%}", f"{seconds:.1f} s" if ahead else "")
    figures = {"ahead": ahead, "back": back, "starts": count}
    return TargetRow(cells, *against_targets([("from everywhere", ahead == count)] if name == OURS else []), figures)
