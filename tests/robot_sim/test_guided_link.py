"""A guided robot believes the coordinator that it has joined, by the session of its liveliness token: nobody else."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import ask, process, turn_until
from touchline.bus import Bus, BusConfig
from touchline.schemas import topics
from touchline.schemas.messages import Event, Guidance, Whereabouts

ROOM = np.array([(1.0, 0.0, 9.0), (-1.0, 0.0, 9.0), (0.0, 1.0, 9.0), (0.0, -1.0, 9.0)])


class Team:
    """A robot, and coordinators that guide it, or would."""

    def __init__(self, bus: Bus, operator: Bus) -> None:
        self.robot = process(bus, speed=5.0)
        self._operator = operator
        self.inbox = operator.inbox([topics.WHEREABOUTS])
        self._events = operator.inbox([topics.EVENTS])
        self.told: list[Event] = []
        self.said = Whereabouts()

    def joins(self, session: str, lockstep_s: float = 0.0) -> Any:
        return ask(self._operator, self.robot, topics.BEGIN_GUIDED, coordinator=session, lockstep_s=lockstep_s)

    def listen(self) -> None:
        for _, said in self.inbox.messages():
            self.said = said if isinstance(said, Whereabouts) else self.said
        self.told += [event for _, event in self._events.messages() if isinstance(event, Event)]

    def until(self, condition: Any, guides: dict[Any, tuple[float, float]]) -> None:
        """Each of some publishers sends the robot somewhere, until something is so."""
        number = 0

        def turned() -> bool:
            nonlocal number
            self.listen()
            number += 1
            for publisher, (x_m, y_m) in guides.items():
                where = {"target_x_m": x_m, "target_y_m": y_m, "half_planes": ROOM.ravel()}
                publisher.send(Guidance(number=number, echo_s=self.said.stamp_s, **where))
            return bool(condition())

        turn_until(self.robot, turned)

    def events(self, code: str) -> list[str]:
        return [event.text for event in self.told if event.code == code]


@pytest.fixture
def team(bus: Bus, operator: Bus) -> Team:
    return Team(bus, operator)


def guidance_of(bus: Bus) -> Any:
    return bus.publisher(topics.GUIDANCE, bus.publisher_id)


def test_only_the_coordinator_that_it_has_joined_moves_it(team: Team, bus_config: BusConfig) -> None:
    with ExitStack() as stack:
        ours, other = (stack.enter_context(Bus.open(topics.COORDINATOR, bus_config)) for _ in range(2))
        stranger = stack.enter_context(Bus.open("stranger", bus_config))
        assert team.joins(ours.session_id).success
        others = {guidance_of(other): (-4.0, 0.0), stranger.publisher(topics.GUIDANCE): (0.0, 4.0)}
        team.until(lambda: len(team.events("stranger")) == 2, others)
        assert abs(team.said.x_m) + abs(team.said.y_m) < 0.1, "it stands where it stood"
        team.until(lambda: team.said.x_m > 0.5, {guidance_of(ours): (4.0, 0.0), **others})
        assert len(team.events("stranger")) == 2, "each is told of once"
        assert ours.session_id in team.events("stranger")[0]


def test_a_stranger_is_told_of_while_sim_time_waits_for_the_coordinator(
    team: Team, bus: Bus, bus_config: BusConfig
) -> None:
    link = team.robot._guided
    with Bus.open(topics.COORDINATOR, bus_config) as ours, Bus.open("stranger", bus_config) as stranger:
        assert team.joins(ours.session_id, lockstep_s=0.4).success
        turn_until(team.robot, lambda: link.held(time.monotonic()))
        stranger.publisher(topics.GUIDANCE).send(Guidance())
        caught_up(bus, stranger)
        assert link.held(time.monotonic())
        team.until(lambda: team.events("stranger"), {})


def test_a_coordinator_that_goes_on_is_waited_for_again(
    team: Team, bus_config: BusConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    link = team.robot._guided
    with Bus.open(topics.COORDINATOR, bus_config) as ours:
        assert team.joins(ours.session_id, lockstep_s=0.4).success
        turn_until(team.robot, lambda: link.held(time.monotonic()))
        monkeypatch.setattr("touchline.services.robot_sim.guided_link.PATIENCE_S", 0.0)
        assert not link.held(time.monotonic() + 1.0)
        monkeypatch.undo()
        assert not link.held(time.monotonic())
        link._note_answer(link._answered_tick + 1)  # for a time that it has passed
        assert link.held(time.monotonic())


def test_it_stops_and_tells_when_its_coordinator_has_gone(team: Team, bus_config: BusConfig) -> None:
    with Bus.open(topics.COORDINATOR, bus_config) as first:
        assert team.joins(first.session_id).success
        team.until(lambda: team.said.x_m > 0.2, {guidance_of(first): (4.0, 0.0)})
    with Bus.open(topics.COORDINATOR, bus_config) as second:
        others = {guidance_of(second): (8.0, 0.0)}
        team.until(lambda: team.events("coordinator-lost"), others)
        team.until(lambda: abs(team.said.stop_x_m - team.said.x_m) < 0.005, others)
        assert len(team.events("coordinator-lost")) == 1
        assert ask(team._operator, team.robot, topics.ABORT).success
        turn_until(team.robot, lambda: team.joins(second.session_id).success)
        here_m = team.said.x_m
        team.until(lambda: abs(team.said.x_m - here_m) > 0.3, others)  # it is guided anew


def test_a_robot_in_a_cell_that_is_taken_over_forgets_it_and_takes_new_ones(team: Team, bus_config: BusConfig) -> None:
    with ExitStack() as stack:
        first, ours = (stack.enter_context(Bus.open(topics.COORDINATOR, bus_config)) for _ in range(2))
        assert team.joins(first.session_id).success
        former = {guidance_of(first): (8.0, 0.0)}
        team.until(lambda: team.said.stop_x_m - team.said.x_m > 0.2, former)
        guided = ask(team._operator, team.robot, topics.SET_OWNER)
        assert (guided.success, guided.coordinator, guided.epoch) == (False, first.session_id, 1)
        stop_m = (said := team.said).stop_x_m
        own = {"coordinator": ours.session_id, "epoch": 2}
        taken = ask(team._operator, team.robot, topics.SET_OWNER, **own)
        assert taken.success
        assert said.adopted > 0
        team.until(
            lambda: team.said.stamp_s > taken.state.stamp_s and team.said.stop_x_m - team.said.x_m < 0.005, former
        )
        assert (team.said.adopted, team.said.decided) == (0, 0)
        assert said.stop_x_m - 0.01 < team.said.x_m
        assert stop_m < 1.0
        team.until(lambda: team.said.x_m > 1.5, {guidance_of(ours): (4.0, 0.0), **former})
        adopted = team.said.adopted
        again = ask(team._operator, team.robot, topics.SET_OWNER, **own)
        team.listen()
        assert again.success
        assert team.said.adopted >= adopted, "an order that it has obeyed before changes nothing"
        assert ask(team._operator, team.robot, topics.ABORT).success
        alone = ask(team._operator, team.robot, topics.SET_OWNER)
        assert (alone.success, alone.coordinator) == (False, "")
        assert "is not guided" in alone.message


def test_who_is_no_coordinator_is_not_joined(team: Team, operator: Bus) -> None:
    for session in ("", "0" * 32, operator.session_id):
        answer = team.joins(session)
        assert not answer.success
        assert "not on the bus as a coordinator" in answer.message
