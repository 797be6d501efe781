"""Recorded team: true places of its robots, contacts, and a picture of their paths."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.body_contacts import BodyContacts, body_radius_m
from touchline.coordination.start_poses import free_area
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Odometry, String
from touchline.schemas.spec import parse
from touchline.schemas.team import TeamScenario

Floats = NDArray[np.float64]

_PERIOD_NS: Final = 20_000_000
"""Period of true poses."""


@dataclass(frozen=True)
class RecordedTeam:
    """Contents of a team's recording.

    Attributes:
        team: The scenario.
        names: Names of the robots, sorted.
        places: (k, n, 2) true places at 50 Hz of sim time (m, map frame), while all were recorded.
    """

    team: TeamScenario
    names: tuple[str, ...]
    places: Floats

    def contacts(self) -> BodyContacts:
        """Return the contacts of bodies, at 50 Hz."""
        found = BodyContacts(len(self.names), body_radius_m(self.team.vehicle), free_area(self.team))
        if len(self.places):
            found.look(self.places)
        return found


def read_team(path: Path) -> RecordedTeam:
    """Read the team in a recording.

    Raises:
        RecordingError: The file cannot be read.
        SpecError: No team is recorded in it.
        PayloadError: A message in it does not fit its topic.
    """
    from touchline.recordings.channels import namespace_at, topic_at
    from touchline.recordings.reader import RecordingReader

    team: TeamScenario | None = None
    places: defaultdict[str, dict[int, tuple[float, float]]] = defaultdict(dict)
    for message in RecordingReader(path).messages():
        topic = topic_at(message.topic)
        if topic is topics.TEAM_SETUP:
            team = parse(TeamScenario, decode(String, message.payload).data, path.name, recorded=True)
        elif topic is topics.TRUTH:
            odometry = decode(Odometry, message.payload)
            at, stamp = odometry.pose.pose.position, odometry.header.stamp
            step = (stamp.sec * 1_000_000_000 + stamp.nanosec) // _PERIOD_NS
            places[namespace_at(message.topic)][step] = (at.x, at.y)
    if team is None:
        raise SpecError(str(path), "", "has no team", "give a recording of `touchline fleet run`")
    names = tuple(name for name in team.names if name in places)
    steps = sorted(set.intersection(*(set(places[name]) for name in names))) if names else []
    rows = [[places[name][step] for name in names] for step in steps]
    return RecordedTeam(team, names, np.array(rows, dtype=np.float64).reshape(len(steps), len(names), 2))


def is_team(path: Path) -> bool:
    """Return whether a recording is of a team.

    Raises:
        RecordingError: The file cannot be read.
    """
    from touchline.recordings.channels import topic_path
    from touchline.recordings.reader import RecordingReader

    reader = RecordingReader(path)
    for _ in reader.messages({topic_path(topics.TEAM_NAMESPACE, topics.TEAM_SETUP)}):
        reader.close()
        return True
    return False


def draw_team(recorded: RecordedTeam, path: Path, robot: str | None = None) -> None:
    """Draw the paths of all robots, or of one, their bodies at the end, and the area, to an SVG or PNG file.

    Raises:
        SpecError: The file cannot be written, or there is no such robot.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.patches import Circle, Polygon

    from touchline.coordination.start_poses import free_area
    from touchline.recordings.writing import writing

    if robot is not None and robot not in recorded.names:
        raise SpecError("command line", "--robot", f"is {robot!r}", f"use one of {', '.join(recorded.names)}")
    area = free_area(recorded.team)
    figure, axes = plt.subplots(figsize=(8.0, 8.0), layout="constrained")
    axes.add_patch(Polygon(np.array(area.shape.exterior.coords), fill=False, color="0.4"))
    for ring in area.shape.interiors:
        axes.add_patch(Polygon(np.array(ring.coords), color="0.85"))
    radius_m = body_radius_m(recorded.team.vehicle)
    for number, name in enumerate(recorded.names):
        path_m = recorded.places[:, number]
        if robot not in (None, name) or not len(path_m):
            continue
        (line,) = axes.plot(path_m[:, 0], path_m[:, 1], linewidth=0.8)
        axes.add_patch(Circle(tuple(path_m[-1]), radius_m, color=line.get_color(), alpha=0.6))
        axes.annotate(name, tuple(path_m[-1]), ha="center", va="center", fontsize=6)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    with writing(path):
        figure.savefig(path)
    plt.close(figure)
