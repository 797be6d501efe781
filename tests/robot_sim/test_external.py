"""An external follower in lock-step: the same session as the built-in that computes the same; and none at all."""

import threading

import numpy as np
import pytest

from examples.external_follower import serve
from examples.external_follower import steer as example
from tests.meeting import caught_up
from tests.robot_sim.scripted import along_x
from touchline.bus import Bus
from touchline.onboard.control import nobody
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.control.timed.regularised import RegularisedLaw
from touchline.onboard.control.timed.tracking_law import LAW_MEMORY, TrackingErrors, Wanted, steer
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.schemas import topics
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig, TrackingGains
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim import lockstep
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.lockstep import Lockstep
from touchline.services.robot_sim.telemetry import Telemetry

PLAN = along_x(0, 0.6, 1.2, 1.7, sprayed=[0, 1, 0], speed_mps=0.8)
VEHICLE = Vehicle()


@pytest.fixture
def buses(bus_config):
    with Bus.open(topics.ROBOT_SIM, bus_config) as robot, Bus.open("follower", bus_config) as outside:
        yield robot, outside


@pytest.fixture
def outside(buses, monkeypatch):
    """Call it with a controller: it then serves until the test ends."""
    monkeypatch.setattr(lockstep, "TIMEOUT_S", 60.0)  # longer than any machine takes for an answer
    serving, stop, threads = threading.Event(), threading.Event(), []

    def ended():
        serving.set()
        return stop.is_set()

    def begin(controller):
        thread = threading.Thread(target=serve, args=(buses[1], controller, ended))
        thread.start()
        threads.append(thread)
        assert serving.wait(60.0)
        caught_up(*buses)

    yield begin
    stop.set()
    for thread in threads:
        thread.join()


def session(follower, ask=nobody, ticks=1500):
    emulator = Emulator(VEHICLE, Scenario(), OnboardConfig(follower=follower), ask=ask)
    telemetry = Telemetry(emulator)
    emulator.load(PLAN)
    emulator.start()
    payloads = []
    while emulator.active and emulator.tick_count < ticks:
        emulator.tick()
        payloads += telemetry.after_tick()
    return emulator, payloads


def test_one_that_keeps_the_plans_time_is_told_all_that_it_needs(buses, outside):
    gains = TrackingGains()
    law = RegularisedLaw(gains.frequency_radps, gains.damping, gains.slow_mps)
    lead = lead_ticks(drive_of(VEHICLE).lag_s)
    side_slip = drive_of(VEHICLE).side_slip_rad_per_mps2

    def controller(request):
        crab = side_slip * request.speed_mps * request.ahead_yaw_rate_radps[0]
        errors = TrackingErrors(request.along_m, request.across_m, request.turn_rad + crab)
        wanted = Wanted(
            float(request.ahead_speed_mps[lead]),
            float(request.ahead_yaw_rate_radps[lead]),
            request.reference_acceleration_mps2,
        )
        return steer(law, errors, wanted, np.zeros(LAW_MEMORY))

    outside(controller)
    emulator, there = session("external-timed", Lockstep(buses[0]))
    _, here = session("regularised")
    assert emulator.onboard.state == TraversalStatus.DONE
    assert there == here


def test_the_example_drives_a_line(buses, outside):
    outside(example)
    emulator, _ = session("external", Lockstep(buses[0]))
    assert emulator.onboard.state == TraversalStatus.DONE
    assert np.abs(emulator.ledger.deviation().lateral_m).max() < 0.04


def test_without_one_the_robot_pauses_and_says_so():
    emulator, _ = session("external", ticks=250)
    assert emulator.onboard.state == TraversalStatus.PAUSED
    assert emulator.onboard.status.reason == "no external follower is connected"
    assert emulator.world.pose.east_m < 0.05
    assert not emulator.command.valve
