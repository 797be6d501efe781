"""Table of teams that change places across a circle: arrival times, and minimum distances."""

from collections.abc import Iterable, Sequence
from typing import Final

from touchline_research.network.deployments import keeps_apart
from touchline_research.network.team_trials import TeamRecord, by_team, listed
from touchline_research.target_table import TargetRow, TargetTable, against_targets

WITHIN_S: Final = 45.0
COLUMNS: Final = ("rules", "robots", "all arrived after", "not arrived", "contacts", "closest", "driven each")


def swap_table(records: Iterable[TeamRecord]) -> TargetTable:
    """Create the table of runs of task swap; those of one team differ in their seeds."""
    groups = by_team(records)
    seeds, duration_s = len(groups[0]), groups[0][0].trial.duration_s
    title = f"Changing places across a circle, up to {duration_s:g} s, {seeds} seed{'s' if seeds > 1 else ''}"
    note = "Arrived is within 10 cm of the opposite place, all at once, by true places."
    return TargetTable(title, COLUMNS, tuple(map(_row, groups)), note)


def _row(group: Sequence[TeamRecord]) -> TargetRow:
    rules, robots = group[0].trial.rules, group[0].trial.robots
    goals = [record.figures["goals"] for record in group]
    arrived_s = [each["all_arrived_s"] for each in goals if each["all_arrived_s"] is not None]
    missing = [robots - each["arrived"] for each in goals]
    contacts = [record.figures["contacts"] for record in group]
    closest_m = min(record.figures["closest_m"] for record in group)
    driven_m = [record.figures["driven_mean_m"] for record in group]
    asked: list[tuple[str, bool]] = []
    if rules.ours:
        in_time = len(arrived_s) == len(group) and max(arrived_s) <= WITHIN_S
        asked = [*keeps_apart(group), (f"all within {WITHIN_S:g} s", in_time)]
    cells = (
        rules.name,
        str(robots),
        listed(arrived_s, ".1f", " s") if arrived_s else "never",
        listed(missing, "d"),
        listed(contacts, "d"),
        f"{closest_m:.3f} m",
        listed(driven_m, ".1f", " m"),
    )
    figures = {
        "robots": robots,
        "missing": sum(missing),
        "contacts": sum(contacts),
        "closest_m": closest_m,
        "driven_most_m": max(driven_m),
    }
    if arrived_s:
        figures["arrived_latest_s"] = max(arrived_s)
    return TargetRow(cells, *against_targets(asked), figures)
