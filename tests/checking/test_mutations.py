"""A change of the code is found, and the part that was changed is named first."""

from dataclasses import replace
from functools import partial

import pytest

from tests.with_full import with_full
from touchline.checking import estimator_alone, replan
from touchline.checking.check_session import check_recording
from touchline.checking.recorded_session import RecordedSession
from touchline.onboard import computer
from touchline.schemas import topics
from touchline.schemas.messages import PlanOptions
from touchline.services.planner.plan import plan
from touchline.services.robot_sim import emulator, loaded_job
from touchline.services.robot_sim.telemetry import Telemetry

pytestmark = pytest.mark.xdist_group("checking")


def changed(model, place, value):
    """The model with one field changed: a number is the factor to it."""
    name, _, rest = place.partition(".")
    old = getattr(model, name)
    new = changed(old, rest, value) if rest else value(old)
    return model.model_validate({**dict(model), name: new})


def world(monkeypatch, place, value):
    kind, _, field = place.partition(".")
    real = emulator.World

    def made(vehicle, scenario):
        vehicle = changed(vehicle, field, value) if kind == "vehicle" else vehicle
        return real(vehicle, changed(scenario, field, value) if kind == "scenario" else scenario)

    monkeypatch.setattr(emulator, "World", made)


def sensors(monkeypatch, place, value):
    real = emulator.Sensors
    monkeypatch.setattr(emulator, "Sensors", lambda vehicle, scenario: real(vehicle, changed(scenario, place, value)))


def estimator(monkeypatch, place, value):
    real = computer.Estimator

    def made(vehicle, config, state):
        return real(vehicle, changed(config, place, value), state)

    for module in (computer, estimator_alone):
        monkeypatch.setattr(module, "Estimator", made)


def follower(monkeypatch, name):
    real = computer.make_follower
    monkeypatch.setattr(computer, "make_follower", lambda _, *others: real(name, *others))


def believing(monkeypatch, place, value):
    real = computer.make_follower

    def made(name, vehicle, *others):
        return real(name, changed(vehicle, place, value), *others)

    monkeypatch.setattr(computer, "make_follower", made)


def planner(monkeypatch, **options):
    other = PlanOptions(**options)
    monkeypatch.setattr(
        replan, "plan", lambda template, vehicle, _, company: plan(template, vehicle, other, company=company)
    )


def ledger(monkeypatch, factor):
    real = loaded_job.PaintLedger
    monkeypatch.setattr(
        loaded_job,
        "PaintLedger",
        lambda wanted, line_m, width_m, *others, **named: real(wanted, line_m, factor * width_m, *others, **named),
    )


def order_later(monkeypatch, name, ticks):
    real = RecordedSession.of.__func__

    def of(cls, messages):
        session = real(cls, messages)
        moved = [each._replace(tick=each.tick + ticks) if each.name == name else each for each in session.orders]
        return replace(session, orders=moved)

    monkeypatch.setattr(RecordedSession, "of", classmethod(of))


def silent(monkeypatch, topic):
    real = Telemetry.told
    monkeypatch.setattr(Telemetry, "told", lambda self: [each for each in real(self) if each[0] is not topic])


def more(old):
    return 1.01 * old


MUTATIONS = {
    "a motor 1 % weaker": (partial(world, place="vehicle.drive.motor.constant_nm_per_a", value=more), "world"),
    "wheels that slip otherwise": (partial(world, place="scenario.drive.slip_relative", value=more), "world"),
    "half of the side slip": (
        partial(believing, place="drive.side_slip_rad_per_mps2", value=lambda old: 0.5 * old),
        "follower",
    ),
    "a heavier body": (partial(world, place="vehicle.body.mass_empty_kg", value=more), "world"),
    "another soil": (partial(world, place="scenario.ground.surface", value=lambda _: "wet-grass"), "world"),
    # At rest the accelerometers feel a slope that moves nothing, so that they differ before what is true does.
    "a slope": (partial(world, place="scenario.ground.grade", value=lambda _: 0.01), "sensors"),
    "a noisier gyro": (partial(sensors, place="imu.gyro_density_radps_rthz", value=more), "sensors"),
    "an accelerometer that drifts": (partial(sensors, place="imu.accel_bias_walk_mps2_rts", value=more), "sensors"),
    "a late fix": (partial(sensors, place="gnss.latency_s", value=lambda old: old + 0.01), "sensors"),
    "whiter fixes": (partial(sensors, place="gnss.white_m", value=more), "sensors"),
    "a magnetometer that is turned": (partial(sensors, place="magnetometer.bias_rad", value=more), "sensors"),
    "another gain of the filter": (partial(estimator, place="gnss.white_m", value=more), "estimator"),
    "a filter that trusts its gyro": (partial(estimator, place="imu.gyro_density_radps_rthz", value=more), "estimator"),
    "a filter with slip": (partial(estimator, place="drive.slip_relative", value=more), "estimator"),
    "another follower": (partial(follower, name="pure-pursuit"), "follower"),
    "a plan with another σ_max": (partial(planner, sigma_max_1pm2=1.5), "plan"),
    "a plan that paints slower": (partial(planner, paint_speed_mps=0.9), "plan"),
    "paint judged by another width": (partial(ledger, factor=0.9), "paint"),
    "valve delay": (partial(world, place="vehicle.tool.valve_on_delay_s", value=lambda old: old + 0.01), "world"),
    "a nozzle 1 cm off": (partial(world, place="vehicle.tool.nozzle_y_m", value=lambda old: old + 0.01), "paint"),
    "a pause one tick later": (partial(order_later, name="pause", ticks=1), "executive"),
    "a topic that is not told": (partial(silent, topic=topics.ESTIMATOR), "estimator"),
}
LATE = {"paint judged by another width", "valve delay", "a nozzle 1 cm off", "a pause one tick later"}
#: Found as others of their part are.
FURTHER = (
    "wheels that slip otherwise",
    "a heavier body",
    "valve delay",
    "a nozzle 1 cm off",
    "whiter fixes",
    "another soil",
    "a noisier gyro",
    "an accelerometer that drifts",
    "a magnetometer that is turned",
    "a filter that trusts its gyro",
    "a filter with slip",
    "a plan that paints slower",
)


def test_the_code_of_today_does_the_same(recording):
    (found,) = check_recording(recording, exact=True)
    assert found.passed, (found.problem, found.first)
    assert found.planned == 1
    assert found.diff.topics[topics.IMU.name].pairs > 550
    assert found.diff.topics[topics.EVENTS.name].pairs >= 3


@pytest.mark.parametrize("name", with_full(*(name for name in MUTATIONS if name not in FURTHER), full=FURTHER))
def test_a_change_is_found_and_its_part_named(monkeypatch, recording, brief, name):
    mutate, part = MUTATIONS[name]
    mutate(monkeypatch)
    (found,) = check_recording(recording if name in LATE else brief, exact=True)
    assert not found.passed
    assert found.part == part, str(found.first)


@pytest.mark.parametrize("part", ["plan", "estimator", "follower"])
def test_a_part_alone_does_the_same_on_what_was_recorded(recording, part):
    (found,) = check_recording(recording, exact=True, only=part)
    assert found.passed, str(found.first)
    assert found.planned == (part == "plan")
    pairs = sum(each.pairs for each in found.diff.topics.values())
    assert pairs >= {"plan": 0, "estimator": 250, "follower": 400}[part]


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("a plan with another σ_max", "plan"),
        ("another gain of the filter", "estimator"),
        ("another follower", "follower"),
        ("half of the side slip", "follower"),
    ],
)
def test_a_part_alone_shows_its_own_changes(monkeypatch, brief, name, part):
    MUTATIONS[name][0](monkeypatch)
    (found,) = check_recording(brief, exact=True, only=part)
    assert found.part == part
    assert not found.passed


@pytest.mark.parametrize("name", ["a heavier body", "a late fix", "whiter fixes", "another follower"])
def test_the_estimator_alone_does_not_see_what_others_do(monkeypatch, brief, name):
    MUTATIONS[name][0](monkeypatch)
    (found,) = check_recording(brief, exact=True, only="estimator")
    assert found.passed, str(found.first)
