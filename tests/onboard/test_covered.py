"""A roller's belief of its progress: the swaths that it has driven, by its own estimate."""

import pytest

from touchline.onboard.executive.covered import Covered
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.messages import PlanOptions, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Area, Polygon, Template
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

CORNERS = ((0.0, 0.0), (14.0, 0.0), (14.0, 4.2), (0.0, 4.2))
ROOM = ((-9.0, -9.0), (23.0, -9.0), (23.0, 13.0), (-9.0, 13.0))
PAN = Template(
    name="pan", areas=(Area(id="pan", outline=CORNERS, angle_deg=0.0),), boundary=Polygon(id="room", corners=ROOM)
)


@pytest.fixture(scope="module")
def trajectory():
    return plan(PAN, CLAY_ROLLER, PlanOptions(order="given", area_method="parallel")).trajectory


def test_only_swaths_count_and_each_as_far_as_it_was_driven(trajectory) -> None:
    loaded = load_trajectory(trajectory, CLAY_ROLLER)
    swaths = [row for row, name in enumerate(loaded.ids) if "#" in name]
    starts_m, lengths_m = loaded.path[swaths, 5], loaded.path[swaths, 4]
    covered = Covered(loaded)
    assert covered.belief(0.0) == (("pan#1", "pan#2"), [0.0, 0.0], 0.0)
    halfway = covered.belief(starts_m[0] + 0.5 * lengths_m[0])
    assert halfway.fractions == pytest.approx([0.5, 0.0])
    assert halfway.coverage_pct == pytest.approx(50.0 * lengths_m[0] / lengths_m.sum())
    assert covered.belief(starts_m[1] - 0.01).fractions == [1.0, 0.0], "a turn covers no swath"
    assert covered.belief(loaded.total_length_m).coverage_pct == 100.0


def test_a_path_without_swaths_counts_as_a_whole(trajectory) -> None:
    segments = tuple(
        segment.model_copy(update={"id": f"s{number}"}) for number, segment in enumerate(trajectory.path.segments)
    )
    path = trajectory.path.model_copy(update={"segments": segments})
    loaded = load_trajectory(trajectory.model_copy(update={"path": path}), CLAY_ROLLER)
    belief = Covered(loaded).belief(0.25 * loaded.total_length_m)
    assert len(belief.ids) == len(segments)
    assert belief.coverage_pct == pytest.approx(25.0)


def test_a_roller_at_work_believes_more_and_more_and_what_comes_after_a_restart(trajectory) -> None:
    def robot() -> Emulator:
        return Emulator(
            CLAY_ROLLER, Scenario(seed=3, ground={"surface": "clay"}), OnboardConfig(follower="pure-pursuit")
        )

    emulator = robot()
    emulator.load(trajectory, PAN)
    assert emulator.onboard.painted.coverage_pct == 0.0
    emulator.start()
    runner, told = FastRunner(emulator), [0.0]
    while emulator.onboard.status.arc_length_m < 0.7 * emulator.onboard.status.total_length_m:
        runner.run(500)
        told.append(emulator.onboard.painted.coverage_pct)
    assert told == sorted(told) and 20.0 < told[-1] < 100.0
    checkpoint = emulator.onboard.checkpoint
    after = robot()
    after.load(trajectory, PAN, checkpoint)
    assert after.onboard.painted == emulator.onboard.painted
    runner.run(100_000)
    assert emulator.onboard.state == TraversalStatus.DONE
    assert emulator.onboard.painted.coverage_pct == pytest.approx(100.0, abs=0.2)


def test_a_roller_waits_out_an_outage_in_which_it_would_leave_strips_out(trajectory) -> None:
    outage = {"kind": "gnss-outage", "start_s": 12.0, "duration_s": 20.0}
    scenario = Scenario(seed=3, ground={"surface": "clay"}, faults=[outage])
    emulator = Emulator(CLAY_ROLLER, scenario, OnboardConfig(follower="pure-pursuit"))
    emulator.load(trajectory, PAN)
    emulator.start()
    runner = FastRunner(emulator)
    while emulator.onboard.state == TraversalStatus.RUNNING:
        runner.run(10)
    assert emulator.onboard.state == TraversalStatus.PAUSED
    assert "σ above 0.05 m" in emulator.onboard.status.reason
    assert 12.0 < emulator.time_s < 32.0
    while emulator.active:
        runner.run(1000)
    assert emulator.onboard.state == TraversalStatus.DONE
