"""A robot without a tool drives a traversal to its end: no paint, no sprayer to tell of, no tank to fill."""

import pytest

from tests.robot_sim.scripted import ScriptedOnboard, along_x, line_script
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import NoTool, Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.telemetry import Telemetry

LINE = along_x(0.0, 3.0, sprayed=[True])


def robot(vehicle: Vehicle) -> tuple[Emulator, Telemetry]:
    emulator = Emulator(vehicle, Scenario(noise="none"), onboard=ScriptedOnboard(line_script))
    return emulator, Telemetry(emulator)


@pytest.mark.parametrize(("tool", "sprays"), [({"tool": NoTool()}, False), ({}, True)])
def test_only_a_sprayer_tells_of_itself_and_paints(tool: dict[str, NoTool], sprays: bool) -> None:
    emulator, telemetry = robot(Vehicle(**tool))
    template = load_template("study-square")
    emulator.load(LINE, template)
    said = [topic for topic, _ in telemetry.loaded(LINE, template)]
    emulator.start()
    while emulator.active:
        emulator.tick()
        said += [topic for topic, _ in telemetry.after_tick()]
    assert emulator.world.pose.east_m > 1.0
    assert {topics.JOINT_STATES, topics.ACTUATOR_COMMAND, topics.TRUE_COVERAGE, topics.BATTERY} <= set(said)
    assert (topics.SPRAYER in said) == (topics.PAINT in said) == sprays
    assert (len(emulator.work.ledger.targets) > 0) == sprays
    assert telemetry.final is not None
    report = telemetry.final.traversal
    assert telemetry.final.area is None
    if not sprays:
        assert report.paint_accepted and report.verdict == "there are no lines to paint"
        assert (report.overspray_m2, report.wet_crossings, report.segments) == (0.0, 0, ())


def test_there_is_no_tank_to_fill() -> None:
    emulator, telemetry = robot(Vehicle(tool=NoTool()))
    with pytest.raises(CommandRefused, match="cannot refill the tank: the vehicle has none"):
        emulator.refill_tank()
    emulator.tick()
    assert emulator.replace_battery() == (pytest.approx(680.0, abs=0.1), 680.0)
    assert [topic for topic, _ in telemetry.supplies()] == [topics.BATTERY]


def test_its_own_computer_drives_along_lines_and_misses_no_paint() -> None:
    vehicle = Vehicle(tool=NoTool())
    emulator = Emulator(vehicle, Scenario(noise="none"))
    emulator.load(along_x(0.0, 3.0, sprayed=[False]))
    emulator.start()
    while emulator.active:
        emulator.tick()
    assert (emulator.onboard.state, emulator.onboard.status.reason) == (TraversalStatus.DONE, "")
    assert emulator.world.pose.east_m == pytest.approx(3.0, abs=0.05)
