"""BARN figures: published results on the challenge's 50 test worlds, and those of the product beside them."""

from __future__ import annotations

from typing import Final, NamedTuple

from touchline_research.target_table import TargetRow, TargetTable, against_targets

LEAST_SUCCESS_PCT: Final = 98.0
LEAST_SCORE: Final = 0.42


class BarnFigures(NamedTuple):
    """Results of a planner in the BARN challenge.

    Attributes:
        name: Name of the planner.
        success_pct: Runs that reached the goal.
        collision_pct: Runs that ended in a contact.
        timeout_pct: Runs that took more than 100 s.
        score: Mean score: success · OT / clip(T, 2·OT, 8·OT), with OT of the reference path at 2 m/s; at most 0.5.
        time_s: Mean time.
    """

    name: str
    success_pct: float
    collision_pct: float
    timeout_pct: float
    score: float
    time_s: float


PUBLISHED: Final = (BarnFigures("DWA, as published", 88.0, 4.8, 7.2, 0.169, 33.5),)
"""The challenge's own baseline, ten runs in each world, from its README."""


def barn_table(ours: BarnFigures | None = None) -> TargetTable:
    """Return the table of figures.

    Args:
        ours: Figures of the product on the same worlds; None: they were not measured.
    """
    rows = [] if ours is None else [TargetRow(_cells(ours), *_targets(ours))]
    rows += [TargetRow(_cells(each)) for each in PUBLISHED]
    note = "" if ours else "The product is not measured here."
    columns = ("planner", "success", "collisions", "time-outs", "score", "mean time")
    return TargetTable(
        "BARN: the challenge's 50 test worlds, as unknown worlds with a lidar", columns, tuple(rows), note
    )


def _targets(ours: BarnFigures) -> tuple[str, bool | None]:
    return against_targets(
        [
            (f"≥ {LEAST_SUCCESS_PCT:g} %", ours.success_pct >= LEAST_SUCCESS_PCT),
            ("no collision", ours.collision_pct == 0.0),
            (f"score ≥ {LEAST_SCORE:g}", ours.score >= LEAST_SCORE),
        ]
    )


def _cells(figures: BarnFigures) -> tuple[str, ...]:
    shares = (f"{each:.1f} %" for each in (figures.success_pct, figures.collision_pct, figures.timeout_pct))
    return (figures.name, *shares, f"{figures.score:.3f}", f"{figures.time_s:.1f} s")
