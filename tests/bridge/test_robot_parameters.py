"""A robot's setup as ROS 2 parameters."""

import pytest

from touchline.schemas.messages import ListParametersRequest, ParameterKind, ParameterValue, RosParameter
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import MAX_SEED, Scenario
from touchline.schemas.setup import Setup
from touchline.services.bridge.robot_parameters import listed, parameters_of, refusal

NAMES = dict.fromkeys(["seed", "gnss.rate_hz", "gnss.noise.white_m", "imu.rate_hz"])


def test_a_setup_is_flat_and_typed_and_every_value_is_that_of_the_setup():
    setup = Setup(onboard=OnboardConfig(follower="pure-pursuit"), scenario=Scenario(seed=7))
    told = parameters_of(setup)
    assert told["use_sim_time"] == ParameterValue(type=ParameterKind.BOOL, bool_value=True)
    assert told["scenario.seed"] == ParameterValue(type=ParameterKind.INTEGER, integer_value=7)
    assert told["onboard.follower"].string_value == "pure-pursuit"
    width = told["vehicle.drive.track_width_m"]
    assert (width.type, width.double_value) == (ParameterKind.DOUBLE, setup.vehicle.drive.track_width_m)
    assert told["vehicle.drive.casters_m"].string_value == "[[0.6, 0.2], [0.6, -0.2]]"
    assert list(told) == sorted(told)


def test_the_largest_seed_is_told_whole():
    told = parameters_of(Setup(scenario=Scenario(seed=MAX_SEED)))["scenario.seed"]
    assert MAX_SEED in (told.integer_value, int(told.string_value or 0))


def test_before_the_robot_has_told_its_setup_there_is_what_every_node_has():
    assert list(parameters_of(None)) == ["use_sim_time"]


@pytest.mark.parametrize(
    ("prefixes", "depth", "found", "begin"),
    [
        ((), 0, ["seed", "gnss.rate_hz", "gnss.noise.white_m", "imu.rate_hz"], ["gnss", "gnss.noise", "imu"]),
        ((), 1, ["seed"], []),
        ((), 2, ["seed", "gnss.rate_hz", "imu.rate_hz"], ["gnss", "imu"]),
        (("gnss",), 0, ["gnss.rate_hz", "gnss.noise.white_m"], ["gnss", "gnss.noise"]),
        (("gnss",), 1, ["gnss.rate_hz"], ["gnss"]),
        (("gn",), 0, [], []),
        (("seed", "imu.rate_hz"), 1, ["seed", "imu.rate_hz"], ["imu"]),
    ],
)
def test_names_are_listed_as_by_a_node_of_rclpy(prefixes, depth, found, begin):
    result = listed(NAMES, ListParametersRequest(prefixes=prefixes, depth=depth))
    assert (list(result.names), list(result.prefixes)) == (found, begin)


def test_nothing_can_be_set_and_the_reason_names_the_parameter():
    known, unknown = (refusal(NAMES, RosParameter(name=name)) for name in ("seed", "sede"))
    assert not known.successful
    assert not unknown.successful
    assert known.reason.startswith("'seed' is read-only")
    assert unknown.reason == "'sede' is no parameter of this robot"
