"""Constants of a calibrated robot: their σ at the start grows with the time since then."""

from datetime import date

import numpy as np
import pytest

from touchline.onboard import Onboard
from touchline.onboard.estimation.learned_constants import start_variance
from touchline.schemas.onboard import Calibrated, Calibrations, OnboardConfig
from touchline.schemas.vehicles import Vehicle

DAY = date(2026, 5, 1)
BY = Calibrated(day=DAY, log="calibration.mcap")
KNOWN = OnboardConfig(calibrated=Calibrations(antenna=BY)).replace("gnss.antenna_sigma_m", 0.002)


def sigmas(config):
    return np.sqrt(Onboard(Vehicle(), config)._estimator.ring.figures.constant_var)


def test_the_age_is_that_on_the_day():
    assert KNOWN.on(date(2026, 5, 31)).calibrated.antenna.age_days == 30.0
    assert KNOWN.on(date(2026, 4, 1)).calibrated.antenna.age_days == 0.0
    assert OnboardConfig().on(DAY) == OnboardConfig()


def test_the_estimator_starts_with_a_sigma_that_has_grown():
    assert sigmas(KNOWN)[1:3] == pytest.approx(0.002)
    month = sigmas(KNOWN.on(date(2026, 5, 31)))
    assert month[1:3] == pytest.approx(np.hypot(0.002, 0.002))
    assert month[[0, 3]] == pytest.approx(sigmas(OnboardConfig())[[0, 3]])


def test_it_grows_no_further_than_to_that_of_a_robot_that_was_never_calibrated():
    old = BY.model_copy(update={"age_days": 10_000.0})
    assert start_variance(1, 0.002, old) == OnboardConfig().gnss.antenna_sigma_m ** 2
    assert start_variance(1, 0.05, old) == pytest.approx(0.05**2)
    assert start_variance(1, 0.0, old) == 0.0
