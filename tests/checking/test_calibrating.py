"""Calibration from a recording whose files are wrong by known amounts."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline.checking.calibrating import constants_fit, drive_calibration
from touchline.checking.calibrating import robot_constants as c
from touchline.checking.calibrating.constants_fit import fit_constants
from touchline.checking.calibrating.drive_calibration import calibrate
from touchline.checking.calibrating.noises import NoiseFit, best_noise, lasts
from touchline.checking.estimating.estimate_figures import error_figures, verdict
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import rerun
from touchline.checking.estimating.reference_frame import FrameFit
from touchline.checking.estimating.revisits import Revisits
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse
from touchline.schemas.template import LineSpec, Template, TemplateSegment
from touchline.schemas.truth import Truth

SQUARE = Path(__file__).parents[1] / "sessions" / "0.2.0" / "square.mcap"
WRONG = {c.GYRO_SCALE: 0.005, c.ANTENNA_X: 0.01, c.ANTENNA_Y: -0.01, c.STAMP_OFFSET: 0.03}
pytestmark = pytest.mark.xdist_group("checking")


@pytest.fixture
def inputs():
    return EstimatorInputs(SQUARE, None)


@pytest.fixture(scope="module")
def found():
    return calibrate(SQUARE, None)


def disturbed(inputs, errors_m):
    """Frames with further errors of their fixes, (fixes, 2)."""
    frames = inputs.frames
    fixes = frames.fixes.copy()
    fixes["east_m"] += errors_m[:, 0]
    fixes["north_m"] += errors_m[:, 1]
    return frames._replace(fixes=fixes)


def drawn(n, sigma_m, tau_s=0.0):
    keep = np.exp(-0.1 / tau_s) if tau_s else 0.0
    errors = np.random.default_rng(5).standard_normal((n, 2)) * sigma_m
    for i in range(1, n):
        errors[i] = keep * errors[i - 1] + np.sqrt(1.0 - keep**2) * errors[i]
    return errors


def test_it_finds_what_the_files_are_wrong_by(inputs):
    inputs.setup = c.changed(inputs.setup, WRONG)
    constants = c.constants_of(inputs.setup)
    fit = fit_constants(inputs, inputs.setup, constants)
    assert fit.converged
    for constant, change, variance in zip(constants, fit.changes, np.diag(fit.covariance), strict=True):
        sigma = max(np.sqrt(variance), constant.floor)
        assert abs(change + WRONG.get(constant, 0.0)) < 2.0 * sigma, constant.name


class Jump:
    """Runs of an estimator whose innovations jump at no change, where a fix passes from one tick to the next."""

    AHEAD = 0.1

    def __init__(self, inputs, setup, constants):
        self.slopes = np.ones((400, 2, 1))

    def innovations(self, changes, trust):
        sigma = (self.slopes**2).sum() ** -0.5
        best = self.AHEAD * sigma if changes[0] <= 0.0 else -self.AHEAD * sigma
        return self.slopes[:, :, 0] * (changes[0] / c.STAMP_OFFSET.start_sigma - best), self.slopes

    def run(self, changes, trust):
        return None


def test_a_search_that_turns_back_at_a_jump_of_the_innovations_ends(inputs, monkeypatch):
    monkeypatch.setattr(constants_fit, "_Runs", Jump)
    fit = fit_constants(inputs, inputs.setup, (c.STAMP_OFFSET,))
    assert fit.converged
    assert abs(fit.changes[0]) < 2.0 * Jump.AHEAD * np.sqrt(fit.covariance[0, 0])


def test_what_a_drive_does_not_tell_has_no_number(found):
    by_name = {each["name"]: each for each in found.as_json()["constants"]}
    assert by_name["gyro scale"]["found"] is None  # it only turns to the right
    assert "turn by at least 180° to each side" in by_name["gyro scale"]["against"]
    assert by_name["antenna forward"]["found"] == pytest.approx(0.0, abs=0.004)
    assert found.believed
    assert found.noise.name == ""
    assert (found.causes, found.not_told) == ((), "")
    wanders = found._replace(noise=NoiseFit("fixes wander", {}, 90.0, ("fixes scatter", 20.0)))
    assert wanders.causes == ("fixes wander",)
    assert "cannot be told by one pass" in wanders.not_told
    assert wanders._replace(passes=Revisits(400, 0.1, (0.0, 0.0), 0.0)).not_told == ""
    unsure = wanders._replace(noise=wanders.noise._replace(runner_up=("fixes scatter", 85.0)))
    assert unsure.causes == ()
    bent = found._replace(passes=Revisits(400, 0.3, (3.0, 6.0), 0.02))
    assert bent.causes == ("the fixes are bent",)
    assert found.setup.onboard.imu.gyro_scale_relative == 0.0


def test_the_command_writes_files_that_can_be_given_again(found, tmp_path, monkeypatch):
    monkeypatch.setattr(drive_calibration, "calibrate", lambda file, *_: {SQUARE: found}[file])
    result = CliRunner().invoke(app, ["calibrate", str(SQUARE), "--json", "--out", str(tmp_path / "robot")])
    assert result.exit_code == 0, result.output
    said = json.loads(result.stdout)
    told = {each["name"]: each["found"] for each in said["constants"]}
    vehicle = load_vehicle(str(tmp_path / "robot" / "vehicle.json"))
    assert vehicle.body.gnss_antenna_x_m == told["antenna forward"]
    onboard = parse(OnboardConfig, (tmp_path / "robot" / "onboard.json").read_text(), "onboard")
    assert onboard.gnss.stamp_offset_s == told["stamp offset"]


@pytest.mark.parametrize(
    ("sigma_m", "tau_s", "named"), [(0.012, 0.0, "fixes scatter"), (0.02, 3.0, "fixes wander")], ids=["white", "slow"]
)
def test_a_noise_larger_than_the_files_say_is_named(inputs, sigma_m, tau_s, named):
    frames = disturbed(inputs, drawn(len(inputs.frames.fixes), sigma_m, tau_s))
    assert best_noise(inputs, inputs.setup, frames).name == named


@pytest.mark.parametrize(
    ("by_stretch", "throughout"),
    [([-10.0, 50.0, -10.0, 80.0, -10.0, 0.0, 0.0], False), ([5.0, -8.0, 5.0, 20.0, 5.0, 0.0, 0.0], True)],
    ids=["bursts", "wander"],
)
def test_fixes_wander_only_if_most_stretches_say_so(by_stretch, throughout):
    """The sums are positive; at the end the robot rests, and no fix counts."""
    gains = np.repeat(np.array(by_stretch) / 50.0, 500) * (np.arange(500 * len(by_stretch)) % 10 == 0)
    assert gains.sum() > 0.0
    assert lasts(gains) is throughout


def test_a_robot_that_does_not_go_where_it_heads_wanders_sideways(tmp_path):
    lines = [LineSpec(start=(0.0, y), end=(16.0, y)) for y in (0.0, 3.0, 6.0)]
    segments = tuple(TemplateSegment(id=f"l{i}", line=line) for i, line in enumerate(lines))
    job = Job.prepare(Template(name="lines", segments=segments), PlanOptions())
    path = tmp_path / "job.mcap"
    simulate(job, Scenario(seed=1, truth=Truth(wander_rad=0.024)), products=Products(record=path))
    inputs = EstimatorInputs(path, None)
    found = best_noise(inputs, inputs.setup, inputs.frames)
    assert found.name == "the robot wanders sideways"
    assert found.told


def test_an_estimate_that_claims_too_much_is_told_and_claims_more(inputs):
    frames = disturbed(inputs, drawn(len(inputs.frames.fixes), 0.03, 3.0))
    over, lines = {}, {}
    for adapts in (False, True):
        run = rerun(inputs, inputs.setup, frames, forgiving=not adapts)
        run.receiver, (run.reference, run.of_antenna, run.emulated) = inputs.receiver(), inputs.reference()
        (lines[adapts],) = [line for line in verdict(run) if "innovations" in line]
        over[adapts] = error_figures(run, FrameFit.NONE)["error_over_claimed"]
    assert lines[False].startswith("not consistent: successive innovations of fixes are correlated by 0.")
    assert "the claimed σ has" in lines[True]
    assert all(line.endswith("`touchline calibrate` looks for the cause") for line in lines.values())
    assert over[False] > 3.0
    assert over[True] < 0.7 * over[False]


def test_no_stretch_with_fixes_speaks_for_a_noise():
    assert lasts(np.zeros(2000)) is False


def test_fixes_that_are_not_rtk_tell_no_constants(inputs):
    fixes = inputs.frames.fixes.copy()
    fixes["fix"] = 2
    inputs.frames = inputs.frames._replace(fixes=fixes)
    with pytest.raises(SpecError, match="has 0 RTK-fixed positions among"):
        fit_constants(inputs, inputs.setup, c.CONSTANTS)


def test_a_short_recording_is_refused(inputs):
    inputs.frames = inputs.frames._replace(fixes=inputs.frames.fixes[:100])
    with pytest.raises(
        SpecError, match="has 100 RTK-fixed positions among 100 fixes; record a drive with at least 150"
    ):
        fit_constants(inputs, inputs.setup, c.CONSTANTS)
