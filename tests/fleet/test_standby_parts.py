"""Parts of a standby: whom it takes over, what it remembers of the task, and how time passes without robots."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import pytest

from touchline.bus import Answer, Bus, BusConfig
from touchline.coordination.start_poses import free_area
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import (
    BeginGuidedResponse,
    PlanState,
    SetOwnerRequest,
    SetOwnerResponse,
    Whereabouts,
)
from touchline.schemas.team import TeamScenario
from touchline.services.coordinator.group_call import start_guidance
from touchline.services.coordinator.recall import Recall
from touchline.services.coordinator.take_over import TakeOver
from touchline.services.coordinator.team_memory import TeamMemory, read_journal
from touchline.services.coordinator.team_service import TeamService, _Phase

TEAM = TeamScenario.model_validate({"robots": 2, "avoid": "plans"})


class Robot:
    """A robot that "old" guides in epoch 3, as its bus; its answers come at once."""

    session_id = "new"

    def __init__(self, there: set[str]) -> None:
        self._there, self._owner, self._epoch = there, "old", 3

    def sessions(self, _: str) -> frozenset[str]:
        return frozenset(self._there)

    def ask(self, _: Any, payload: bytes, __: float) -> Robot:
        request = decode(SetOwnerRequest, payload)
        taken = request.epoch > self._epoch
        if taken:
            self._owner, self._epoch = request.coordinator, request.epoch
        response = SetOwnerResponse(success=taken, message="-", coordinator=self._owner, epoch=self._epoch)
        self._answer = Answer(encode(response), None)
        return self

    def poll(self) -> Answer:
        return self._answer


class Slow(Robot):
    """A robot that does not answer a question in time."""

    def __init__(self) -> None:
        super().__init__({"old", "new"})
        self.asked, self.silent = list[str](), True

    def ask(self, service: Any, payload: bytes, timeout_s: float) -> Robot:
        self.asked.append(decode(SetOwnerRequest, payload).request_id)
        super().ask(service, payload, timeout_s)
        self._answer = Answer(None, None) if self.silent else self._answer
        return self


def test_a_question_without_an_answer_is_repeated_and_an_answered_one_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("touchline.services.coordinator.take_over._AGAIN_S", 0.0)
    robot = Slow()
    taking = TakeOver({"a": cast(Bus, robot)})
    taking.turn()
    robot.silent = False
    assert not any(taking.turn() for _ in range(2))
    first, again, new = robot.asked
    assert first == again
    assert new != first


def test_robots_of_a_coordinator_that_is_on_the_bus_are_not_taken_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("touchline.services.coordinator.take_over._AGAIN_S", 0.0)
    there = {"old", "new"}
    taking = TakeOver({name: cast(Bus, Robot(there)) for name in "ab"})
    assert not taking.turn()
    assert taking.former_is_back
    assert taking.waits_for["a"] == "obeys session old, which is on the bus"
    there.discard("old")
    assert not taking.turn()
    assert not taking.former_is_back
    assert taking.turn()
    assert taking.epoch == 4


class RobotInCell:
    """A robot by cells as its bus: it obeys "old"; or nobody, and brakes for one more question."""

    session_id = "new"

    def __init__(self, there: set[str], owner: str) -> None:
        self._there, self.owner, self._driving, self.asked = there, owner, 2, list[str]()

    def sessions(self, _: str) -> frozenset[str]:
        return frozenset(self._there)

    def ask(self, service: topics.Service[Any, Any], payload: bytes, __: float) -> RobotInCell:
        self.asked.append(service.name)
        if service is topics.SET_OWNER:
            request = decode(SetOwnerRequest, payload)
            taken = bool(self.owner) and request.epoch > 3
            self.owner = request.coordinator if taken else self.owner
            response = SetOwnerResponse(
                success=taken,
                message="-" if self.owner else "the robot is not guided",
                coordinator=self.owner,
                epoch=request.epoch if taken else 3,
                state=PlanState(stamp_s=7.5),
            )
            self._answer = Answer(encode(response), None)
        else:
            self._driving -= 1
            self.owner = self.owner if self._driving else "new"
            taken = BeginGuidedResponse(success=not self._driving, message="it brakes")
            self._answer = Answer(encode(taken), None)
        return self

    def poll(self) -> Answer:
        return self._answer


def recall(robots: dict[str, RobotInCell]) -> Recall:
    return Recall(cast(dict[str, Bus], robots), lambda buses: start_guidance(buses, 0.4, plans=False, margin_m=0.02))


def test_robots_by_cells_forget_them_and_those_that_nobody_guides_are_guided_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("touchline.services.coordinator.take_over._AGAIN_S", 0.0)
    monkeypatch.setattr("touchline.services.coordinator.recall._AGAIN_S", 0.0)
    there = {"old", "new"}
    robots = {"a": RobotInCell(there, "old"), "b": RobotInCell(there, "")}
    recalling = recall(robots)
    assert not any(recalling.turn() for _ in range(5))
    assert recalling.former_is_back
    there.discard("old")
    assert not any(recalling.turn() for _ in range(4))
    assert recalling.waits_for == {"b": "it brakes"}
    assert any(recalling.turn() for _ in range(4))
    assert {robot.owner for robot in robots.values()} == {"new"}
    assert not recalling.waits_for
    assert recalling.stamps_s == {"a": 7.5}
    assert set(robots["a"].asked) == {topics.SET_OWNER.name}


def test_robots_by_cells_that_nobody_guided_are_left_alone() -> None:
    robots = {name: RobotInCell({"new"}, "") for name in "ab"}
    recalling = recall(robots)
    assert not any(recalling.turn() for _ in range(5))
    assert recalling.none_is_guided
    assert not recalling.former_is_back
    assert set(robots["a"].asked) == {topics.SET_OWNER.name}


class Recalled:
    """A recall that is over."""

    none_is_guided, waits_for, stamps_s = False, dict[str, str](), {"tb1": 7.0, "tb2": 7.0}

    def turn(self) -> bool:
        return True


def test_the_first_cells_are_made_at_the_first_exchange_after_all_robots_have_forgotten_theirs(
    bus_config: BusConfig,
) -> None:
    team = TeamScenario.model_validate({"robots": 2, "avoid": "cells"})
    with Bus.open(topics.COORDINATOR, bus_config.of(topics.TEAM_NAMESPACE)) as bus:
        service = TeamService(bus, team, free_area(team), lockstep=False, alone=False, former=TeamMemory(team=team))
        service._taking = cast(Recall, Recalled())
        links = service._robots.links.values()
        for link in links:
            link.whereabouts = Whereabouts(stamp_s=7.0, adopted=9, decided=9)  # as it reported to the former one
        service.turn()
        for stamp_s in (9.1, 9.2):
            assert not service.figures["updates"]
            for place, link in enumerate(links):
                link.whereabouts = Whereabouts(
                    stamp_s=stamp_s, x_m=1.0 + place, y_m=1.0, stop_x_m=1.0 + place, stop_y_m=1.0
                )
                link.fresh = True
            service.turn()
        assert service.figures["updates"] == 1
        assert service._coordination.hub is not None


def test_what_a_robot_has_reported_since_it_forgot_its_cell_is_kept(bus_config: BusConfig) -> None:
    """In lockstep it waits for an answer to that, and reports nothing else meanwhile."""
    team = TeamScenario.model_validate({"robots": 2, "avoid": "cells"})
    with Bus.open(topics.COORDINATOR, bus_config.of(topics.TEAM_NAMESPACE)) as bus:
        service = TeamService(bus, team, free_area(team), lockstep=True, alone=False, former=TeamMemory(team=team))
        service._taking = cast(Recall, Recalled())
        before, since = (Whereabouts(stamp_s=stamp_s) for stamp_s in (7.0, 7.2))
        links = service._robots.links
        links["tb1"].whereabouts, links["tb2"].whereabouts = before, since
        service.turn()
        assert links["tb1"].whereabouts is None
        assert links["tb2"].whereabouts == since


def test_a_journal_is_of_the_same_team_or_counts_for_nothing(tmp_path: Path) -> None:
    file, without = tmp_path / "team.json", TeamMemory(team=TEAM)
    assert read_journal(file, TEAM) == without
    file.write_text("{")
    assert read_journal(file, TEAM) == without
    kept = TeamMemory(team=TEAM.model_copy(update={"duration_s": 7.0}))
    file.write_text(kept.model_dump_json())
    assert read_journal(file, TEAM) == kept
    other = TeamScenario.model_validate({"robots": 3, "avoid": "plans"})
    assert read_journal(file, other) == TeamMemory(team=other)


def test_no_time_passes_while_no_robot_is_heard(bus_config: BusConfig) -> None:
    with Bus.open(topics.COORDINATOR, bus_config.of(topics.TEAM_NAMESPACE)) as bus:
        service = TeamService(bus, TEAM, free_area(TEAM), lockstep=True, alone=False)
        service._phase, begun_s = _Phase.GUIDING, service.figures["sim_time_s"]
        for link in service._robots.links.values():
            link.heard_at_s = -1e9
        assert not any(service.turn() for _ in range(5))
        assert service.figures["sim_time_s"] == begun_s
