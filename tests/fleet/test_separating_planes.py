"""Planes that are made at once for a whole team give the cells that they give when they are looked at one by one."""

import numpy as np
import pytest

from tests.fleet.teams import FAIR, Team, Weather, corner_grid, square
from touchline.coordination import hub
from touchline.coordination.hub import Hub
from touchline.coordination.tasks import Deploy

FROZEN = Weather(frozen=(("tb03", 3.0, 12.0), ("tb07", 5.0, 7.0)))
FEW_LOST = Weather(lost=0.1, delay_s=0.1)


class BothWays:
    """Two hubs that are told the same, one of which takes nobody for a mate of others; what they say has to agree."""

    def __init__(self, *given, patch: pytest.MonkeyPatch) -> None:
        area, _, *others = given
        self._fast, self._slow, self._patch = Hub(*given), Hub(area, Deploy(area), *others), patch
        self.mates = 0

    @property
    def resting(self) -> frozenset[str]:
        return self._fast.resting

    def receive(self, *given) -> None:
        self._fast.receive(*given)
        self._slow.receive(*given)

    def join(self, *given) -> None:
        self._fast.join(*given)
        self._slow.join(*given)

    def leave(self, name: str) -> None:
        self._fast.leave(name)
        self._slow.leave(name)

    def update(self, now_s: float) -> None:
        self._fast.update(now_s)
        self.mates = max(self.mates, *(len(made[max(made)].mates) for made in self._using()))
        with self._patch.context() as patch:
            patch.setattr(hub._Robot, "uses_only", lambda *_: False)
            self._slow.update(now_s)

    def _using(self):
        return [robot.using for robot in self._fast._robots.values()]

    def guidance(self):
        one, other = self._fast.guidance(), self._slow.guidance()
        for name, told in one.items():
            assert told.half_planes.tobytes() == other[name].half_planes.tobytes()
            assert self._fast.cells[name].half_planes.tobytes() == self._slow.cells[name].half_planes.tobytes()
            assert self._fast.cells[name].corners.tobytes() == self._slow.cells[name].corners.tobytes()
            plain = {"half_planes": ()}
            assert told.model_copy(update=plain) == other[name].model_copy(update=plain)
        return one


@pytest.mark.parametrize("weather", [FAIR, FROZEN, FEW_LOST], ids=["fair", "frozen", "few-lost"])
def test_planes_of_a_whole_round_and_one_by_one_give_the_same_bits(
    weather: Weather, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.fleet.teams.Hub", lambda *given: BothWays(*given, patch=monkeypatch))
    area = square(5.0)
    team = Team(corner_grid(9), area, Deploy(area), weather, seed=4)
    team.run(8.0)
    team.join("tb99", np.array((4.6, 4.6, 0.0, 0.0)))
    team.run(16.0)
    team.leave("tb05")
    team.run(20.0)
    assert team.hub.mates >= (9 if weather is not FEW_LOST else 2)
    assert not team.hub.resting
