"""State that objects and kernels share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import deepcopy
from typing import Annotated

import numpy as np
import pytest
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.records import OpenLength, Record, RecordArray


class Wheel(Record):
    rate_radps: float = math.nan
    ticks: int
    still: bool = True


class Robot(Record):
    pose: Annotated[NDArray[np.float64], 3]
    grid: Annotated[NDArray[np.int64], 2, 4]
    wheel: Wheel
    casters: Annotated[RecordArray[Wheel], 3]


@kernel
def roll(robot: Sequence[Robot]) -> None:
    r = robot[0]
    turn(r.wheel)
    r.pose[1] += r.wheel.rate_radps
    r.grid[1, 2] = r.wheel.ticks
    turn(r.casters[1])
    r.casters[2] = r.casters[1]
    turn(r.casters[2])


@kernel
def turn(wheel: Wheel) -> None:
    wheel.rate_radps = 2.5
    wheel.ticks += 1
    wheel.still = wheel.rate_radps == 0.0


def test_fields_begin_with_their_defaults() -> None:
    robot = Robot()
    assert math.isnan(robot.wheel.rate_radps) and robot.wheel.ticks == 0 and robot.wheel.still is True
    assert robot.pose.tolist() == [0.0, 0.0, 0.0] and robot.grid.shape == (2, 4)
    assert Wheel(ticks=3).ticks == 3


def test_what_a_kernel_writes_python_reads_and_the_other_way_round() -> None:
    robot = Robot()
    robot.wheel.ticks = 6
    robot.pose[:] = 1.0
    roll(robot.array)
    assert (robot.wheel.rate_radps, robot.wheel.ticks, robot.wheel.still) == (2.5, 7, False)
    assert robot.pose.tolist() == [1.0, 3.5, 1.0] and robot.grid[1, 2] == 7
    assert type(robot.wheel.ticks) is int and type(robot.wheel.still) is bool


def test_records_in_a_row_lie_in_the_memory_of_the_whole() -> None:
    robot = Robot()
    robot.casters[1].ticks = 6
    roll(robot.array)
    assert [(caster.ticks, caster.still) for caster in robot.casters] == [(0, True), (7, False), (8, False)]
    robot.casters[0] = robot.casters[-1]
    robot.casters[2].ticks = 0
    assert [caster.ticks for caster in deepcopy(robot).casters] == [8, 7, 0]
    robot.casters.reset()
    assert all(math.isnan(caster.rate_radps) and caster.still for caster in robot.casters)
    with pytest.raises(IndexError):
        robot.casters[3]
    assert len(Wheel.row(4)) == 4


def test_a_record_is_assigned_by_value() -> None:
    wheel, other = Wheel(ticks=3), Wheel()
    other.assign(wheel)
    wheel.ticks = 4
    assert other.ticks == 3


def test_a_reset_reaches_the_parts() -> None:
    robot = Robot()
    roll(robot.array)
    robot.reset()
    assert math.isnan(robot.wheel.rate_radps) and robot.wheel.ticks == 0 and not robot.grid.any()


def test_the_copy_of_a_part_is_a_part_of_the_copy() -> None:
    robot = Robot()
    copied, wheel = deepcopy((robot, robot.wheel))
    roll(copied.array)
    assert wheel.ticks == 1 and wheel is copied.wheel
    assert robot.wheel.ticks == 0 and robot.pose[1] == 0.0


class Legs(Record):
    reach_m: Annotated[NDArray[np.float64], OpenLength()] = np.ones(1)
    figures: Annotated[NDArray[np.float64], 2, 3 + OpenLength()]
    steps: int = -1


class Walker(Record):
    legs: Legs
    pairs: Annotated[RecordArray[Legs], 2]
    wheel: Wheel


@kernel
def step(walker: Sequence[Walker]) -> None:
    for index in range(len(walker[0].legs.reach_m)):
        walker[0].legs.reach_m[index] += index


def test_an_open_length_is_given_when_a_record_is_made() -> None:
    for count in (1, 4):
        walker = Walker.sized(count)()
        assert isinstance(walker, Walker)
        assert (walker.legs.steps, walker.pairs[1].steps) == (-1, -1)
        assert walker.legs.figures.shape == (2, 3 + count)
        step(walker.array)
        assert walker.legs.reach_m.tolist() == [1.0 + index for index in range(count)]
        assert deepcopy(walker).legs.reach_m.tolist() == walker.legs.reach_m.tolist()
    assert Walker.sized(4) is Walker.sized(4)
    assert Wheel.sized(4) is Wheel
    with pytest.raises(TypeError, match=r"Walker leaves the length of arrays open; make it by Walker.sized\(length\)"):
        Walker()
