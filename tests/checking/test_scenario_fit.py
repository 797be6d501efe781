"""A scenario fitted to an emulated log is the one that it was emulated with."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.checking.test_log_statistics import VEHICLE, drive
from tests.command import app
from touchline.checking.reality import log_statistics as s
from touchline.checking.reality.emulated_log import emulated
from touchline.checking.reality.emulator_beside import beside
from touchline.checking.reality.log_samples import LogSamples
from touchline.checking.reality.scenario_fit import fit_scenario
from touchline.checking.reality.told import Told
from touchline.cli.fit_command import off_lines
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import DriveNoise, GnssNoise, Ground, Scenario
from touchline.schemas.spec import parse
from touchline.schemas.truth import Truth
from touchline_research.reality.reality_study import not_told, row

SQUARE = Path(__file__).parents[1] / "sessions" / "0.2.0" / "square.mcap"
TRUE = Scenario(
    seed=5,
    gnss=GnssNoise(white_m=0.002, gauss_markov_1_m=0.0, gauss_markov_2_m=0.0),
    drive=DriveNoise(slip_relative=0.06),
    ground=Ground(roughness="B"),
    truth=Truth(wander_rad=0.03, wander_m=0.8, vibration_mps2=0.5),
)
pytestmark = pytest.mark.xdist_group("checking")


def test_the_scenario_of_an_emulated_log_is_found():
    time_s, wheels, _, _ = drive(300.0)
    commanded = LogSamples(time_s, wheels, np.full((len(time_s), 6), np.nan), np.zeros((0, 3)), 0.01, VEHICLE)
    log = emulated(commanded, TRUE, 100.0)
    fit = fit_scenario(log, Scenario(), OnboardConfig())
    truth, ground = fit.scenario.truth, fit.scenario.ground
    assert fit.imu_hz == 100.0
    assert truth.wander_rad * truth.wander_m**0.5 == pytest.approx(0.03 * 0.8**0.5, rel=0.25)
    assert truth.vibration_mps2 == pytest.approx(0.5, rel=0.1)
    assert (ground.roughness, ground.roughness_factor) == ("C", pytest.approx(0.5, rel=0.15))
    assert fit.scenario.drive.slip_relative == pytest.approx(0.06, rel=0.25)
    assert fit.scenario.gnss.white_m == pytest.approx(0.002, rel=0.35)
    assert fit.scenario.imu.gyro_density_radps_rthz == pytest.approx(TRUE.imu.gyro_density_radps_rthz, rel=0.35)
    assert fit.onboard.drive.side_slip_m_rtm == pytest.approx(truth.wander_rad * (2.0 * truth.wander_m) ** 0.5)
    assert fit.onboard.gnss.white_m == fit.scenario.gnss.white_m
    again = s.log_statistics(emulated(log, fit.scenario.replace("seed", 6), fit.imu_hz))
    for key in (s.LATERAL[1], s.LATERAL[2], s.SLIP, s.SCATTER, s.SHAKING, s.ROLLING):
        assert again[key].value == pytest.approx(fit.statistics[key].value, rel=0.25), key


def test_the_command_writes_a_scenario_that_can_be_read(tmp_path):
    result = CliRunner().invoke(app, ["fit", str(SQUARE), "--json", "--out", str(tmp_path / "as-square")])
    assert result.exit_code == 0, result.output
    given = json.loads(result.stdout)
    assert given["statistics"]["sigma"]["value"] is None and given["statistics"]["sigma"]["untold"]
    scenario = parse(Scenario, (tmp_path / "as-square" / "scenario.json").read_text(), "scenario.json")
    assert scenario.name == "as square"
    parse(OnboardConfig, (tmp_path / "as-square" / "onboard.json").read_text(), "onboard.json")


def test_a_row_is_met_by_15_percent_or_by_chance_and_what_is_not_told_has_none():
    near, far, chance = (
        row(s.SIGMA, beside(0.005, [Told(0.001 * value) for value in values]))
        for values in ((5.4, 5.6), (6.0, 6.1), (4.0, 8.0))
    )
    assert (near.met, far.met, chance.met) == (True, False, True)
    assert chance.cells[-1] == "chance explains it" and near.cells[1:3] == ("5", "5.5")
    lost = row(s.SIGMA, beside(0.005, [Told(0.005), Told(None, "it rests for 9 s at most")]))
    assert lost.met is False and "rests for 9 s" in lost.cells[-1]
    untold = {s.SIGMA: Told(None, "short"), s.SLIP: Told(0.01), s.AUTOCORRELATION: Told(None, "short")}
    assert not_told(untold) == "Not told: σ of fixes at rest, autocorrelation of fixes at 60 s (short)."


def test_fit_says_which_statistics_the_emulator_does_not_have():
    found = {
        s.SIGMA: beside(0.005, [Told(0.0054), Told(0.0056)]),
        s.SLIP: beside(0.01, [Told(0.02), Told(0.021)]),
        s.BIAS_WALK: beside(0.01, [Told(None, "short"), Told(None, "short")]),
    }
    assert [line.partition(": ")[2] for line in off_lines(found)] == [
        "the emulator with this scenario differs by +105 %",
        "the emulator with this scenario does not tell it: short",
    ]


def test_the_study_needs_logs_and_they_need_it():
    for arguments in (["study", "reality"], ["study", "coverage", str(SQUARE)]):
        assert CliRunner().invoke(app, arguments).exit_code != 0
