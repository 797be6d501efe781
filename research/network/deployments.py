"""Table of teams that spread over an area: contacts, final cost H, time and distance driven."""

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple

from touchline_research.network.team_trials import BEARING, TeamRecord, by_team, listed
from touchline_research.target_table import TargetRow, TargetTable, against_targets

OFF_BODIES_M: Final = 0.01
"""Minimum clearance between two bodies."""
OF_POINTS: Final = 1.015
"""Maximum final H, relative to that of Lloyd's rule with points."""
STUDY_CONTACTS: Final = 10
"""Number of contacts that the study's rules must exceed: else there is no problem to solve."""


class AskedSpread(NamedTuple):
    """Targets of a team: time until it has spread (s), and mean distance driven (m)."""

    within_s: float
    driven_m: float


ASKED: Final[Mapping[int, AskedSpread]] = MappingProxyType(
    {10: AskedSpread(20.0, 3.5), 20: AskedSpread(25.0, 4.5), 50: AskedSpread(40.0, 7.0)}
)

COLUMNS: Final = (
    "rules",
    "robots",
    "contacts",
    "closest",
    "H / H□",
    "H / points",
    "within 5 % after",
    "driven each",
    "beyond walls",
)


def deployment_table(records: Iterable[TeamRecord]) -> TargetTable:
    """Create the table of runs of task deploy; those of one team differ in their seeds."""
    groups = by_team(records)
    seeds, duration_s = len(groups[0]), groups[0][0].trial.duration_s
    title = f"Spreading from a corner over 2.5 m² a robot, {duration_s:g} s, {seeds} seed{'s' if seeds > 1 else ''}"
    note = (
        "A contact is two bodies that come to touch, by their true places at 100 Hz. H□ is the cost of squares, points "
        "are those that Lloyd's rule leads from the same start. Driven is the mean of a team's robots; beyond walls "
        "are robot-seconds in which a body was not wholly inside."
    )
    return TargetTable(title, COLUMNS, tuple(map(_row, groups)), note)


def keeps_apart(group: Sequence[TeamRecord]) -> list[tuple[str, bool]]:
    """Targets of our rules in all tasks: no contacts, and a minimum distance."""
    apart_m = 2.0 * group[0].body_radius_m + OFF_BODIES_M
    closest_m = min(record.figures["closest_m"] for record in group)
    return [
        ("no contact", not any(record.figures["contacts"] for record in group)),
        (f"≥ {apart_m:.3f} m apart", closest_m >= apart_m),
        ("nobody stops", not any(record.figures["stopped"] for record in group)),
    ]


def _row(group: Sequence[TeamRecord]) -> TargetRow:
    rules, robots = group[0].trial.rules, group[0].trial.robots
    deployed = [record.figures["deploy"] for record in group]
    contacts = [record.figures["contacts"] for record in group]
    closest_m = [record.figures["closest_m"] for record in group]
    of_squares, of_points, spread_s = (
        [each[name] for each in deployed] for name in ("of_squares", "of_points", "spread_s")
    )
    driven_m = [record.figures["driven_mean_m"] for record in group]
    beyond_s = [record.figures["beyond_walls_robot_s"] for record in group]
    asked: list[tuple[str, bool]] = []
    if rules.ours:
        asked += keeps_apart(group)
        asked.append((f"≤ {OF_POINTS:g} of points", max(of_points) <= OF_POINTS))
        wanted = ASKED.get(robots, AskedSpread(math.inf, math.inf))
        if robots in ASKED:
            asked.append((f"≤ {wanted.within_s:g} s", max(spread_s) <= wanted.within_s))
            asked.append((f"≤ {wanted.driven_m:g} m on average", max(driven_m) <= wanted.driven_m))
    elif rules == BEARING and robots == 10:
        asked.append((f"> {STUDY_CONTACTS} contacts", min(contacts) > STUDY_CONTACTS))
    cells = (
        rules.name,
        str(robots),
        listed(contacts, "d"),
        f"{min(closest_m):.3f} m",
        listed(of_squares, ".2f" if not rules.ours else ".3f"),
        listed(of_points, ".2f" if not rules.ours else ".3f"),
        listed(spread_s, ".0f", " s"),
        listed(driven_m, ".1f", " m"),
        listed(beyond_s, ".0f", " s"),
    )
    figures = {
        "robots": robots,
        "contacts": sum(contacts),
        "closest_m": min(closest_m),
        "of_squares_worst": max(of_squares),
        "of_points_worst": max(of_points),
        "spread_longest_s": max(spread_s),
        "driven_most_m": max(driven_m),
        "beyond_walls_most_s": max(beyond_s),
    }
    return TargetRow(cells, *against_targets(asked), figures)
