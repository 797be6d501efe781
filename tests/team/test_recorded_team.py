"""A team as it was recorded: contacts by the true places of all robots at the same time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from touchline.jobs.team.recorded_team import draw_team, is_team, read_team
from touchline.recordings.recorder import Recorder
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Header, Odometry, Point, Pose, PoseWithCovariance, String, Time
from touchline.schemas.team import TeamScenario

TEAM = TeamScenario(robots=2)


def recorded(path: Path, apart_m: list[float]) -> Path:
    """Two robots, so far apart from one 50th of a second to the next; the second one's first pose is missing."""
    recorder = Recorder(path, (*TEAM.names, topics.TEAM_NAMESPACE))
    recorder.write(topics.TEAM_SETUP.name, encode(String(data=TEAM.model_dump_json())), 1, namespace="team")
    for step, metres in enumerate(apart_m):
        for name, x in (("tb1", 0.0), ("tb2", metres)):
            if step or name == "tb1":
                head = Header(stamp=Time(sec=0, nanosec=20_000_000 * step), frame_id="map")
                pose = PoseWithCovariance(pose=Pose(position=Point(x=1.0 + x, y=2.0)))
                told = Odometry(header=head, child_frame_id="base_link", pose=pose)
                recorder.write(topics.TRUTH.name, encode(told), step + 1, namespace=name)
    recorder.finish()
    return path


def test_contacts_are_those_of_places_at_the_same_time(tmp_path: Path) -> None:
    team = read_team(recorded(tmp_path / "a.mcap", [0.2, 0.5, 0.4, 0.3, 0.34, 0.5, 0.35]))
    assert team.names == ("tb1", "tb2")
    assert np.allclose(team.places[:, 1, 0] - team.places[:, 0, 0], [0.5, 0.4, 0.3, 0.34, 0.5, 0.35])
    contacts = team.contacts()
    assert contacts.pairs == [(0, 1), (0, 1)]
    assert contacts.closest_m == pytest.approx(0.3)


def test_a_team_is_drawn_whole_or_one_robot_of_it(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.mcap", [0.5, 0.5, 0.6])
    assert is_team(path)
    team, sizes = read_team(path), []
    for robot in (None, "tb2"):
        draw_team(team, tmp_path / "team.svg", robot)
        sizes.append((tmp_path / "team.svg").read_text().count("<path"))
    assert sizes[0] > sizes[1]
    with pytest.raises(SpecError, match="use one of tb1, tb2"):
        draw_team(team, tmp_path / "team.svg", "tb3")


def test_a_recording_without_a_team_says_so(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "b.mcap")
    recorder.write(topics.TEMPLATE.name, encode(String(data="")), 1)
    recorder.finish()
    assert not is_team(tmp_path / "b.mcap")
    with pytest.raises(SpecError, match="has no team"):
        read_team(tmp_path / "b.mcap")
