"""A newcomer is one registration: it plans or drives, and stands in the help and in the console's list."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from textual.widgets import Input
from typer.testing import CliRunner

from tests.command import app
from tests.robot_sim.test_fast_runner import assert_same
from tests.tui.console import console
from touchline.jobs.single.simulation import Job, simulate
from touchline.onboard.control import Ask, PurePursuitFollower, make_follower
from touchline.onboard.control.follower import BodyTwist
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import FOLLOWERS, METHODS, Registry, UnknownPlugin
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.transitions.method_choice import Method, method_of
from touchline.services.planner.transitions.pricing import OneByOne, pricing_of
from touchline.services.planner.transitions.transitions import TransitionFamily
from touchline.tui.dialogs import Choice, PlanDialog


class Dawdler(PurePursuitFollower):
    """Pure pursuit, a little slower: compiled nowhere but in part."""

    name = "dawdler"

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        speed_mps, yaw_rate_radps, _ = super().step(now, ahead)
        return BodyTwist(0.999 * speed_mps, 0.999 * yaw_rate_radps)


class Outsider:
    """A follower of somebody else, related to none of ours."""

    name, can_fail, problem, fallbacks = "outsider", False, "", 0

    def __init__(self, vehicle: Vehicle, _ask: Ask) -> None:
        self._inner = Dawdler(vehicle)
        self.ahead_rows, self.fine_rows = self._inner.ahead_rows, self._inner.fine_rows

    def reset(self) -> None:
        self._inner.reset()

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        return self._inner.step(now, ahead)


class Roundabout(ContinuousDubins):
    """A transition method of somebody else: twice as gentle."""

    name = "roundabout"

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        super().__init__(0.5 * curvature_max_1pm, 0.5 * sharpness_max_1pm2)


@pytest.fixture(autouse=True)
def newcomers() -> Iterator[None]:
    method = Method(lambda x: TransitionFamily.of_one(Roundabout, x))
    METHODS.register("roundabout", "gentle: turns of twice the radius", method, {"kappa_max_1pm": "half the others'"})
    FOLLOWERS.register("outsider", "dawdles along", Outsider)
    FOLLOWERS.register("dawdler", "dawdles, too", lambda vehicle, _ask: Dawdler(vehicle))
    yield
    METHODS.forget("roundabout")
    FOLLOWERS.forget("outsider")
    FOLLOWERS.forget("dawdler")


def test_newcomers_plan_and_drive() -> None:
    options = PlanOptions(method="roundabout")
    job = Job.prepare(load_template("study-square"), options)
    config = parse(OnboardConfig, '{"follower": "outsider"}', "robot.json")
    outcome = simulate(job, Scenario(), config)
    assert outcome.report.success
    assert outcome.report.coverage_pct > 99.0
    assert isinstance(pricing_of(transitions_of(Vehicle(), options, Limits.of(Vehicle(), options))), OneByOne)


@pytest.mark.parametrize("follower", ["outsider", "dawdler"])
@pytest.mark.parametrize("listen_from", [57, pytest.param(700, marks=pytest.mark.full)])
def test_a_newcomer_drives_to_the_same_bytes_quickly_and_tick_by_tick(follower: str, listen_from: int) -> None:
    _, report, *_ = assert_same(Scenario(seed=4, gnss=GnssNoise.white_tail()), listen_from, follower=follower)
    assert report.success


@pytest.mark.parametrize("command", ["plan", "simulate", "run"])
def test_newcomers_are_in_the_help(command: str) -> None:
    text = " ".join(CliRunner().invoke(app, [command, "--help"]).output.replace("│", " ").split())
    assert "roundabout: gentle" in text
    assert command == "plan" or "outsider: dawdles along" in text


async def test_a_new_method_is_in_the_consoles_list_with_what_empty_limits_mean() -> None:
    async with console(size=(80, 24)) as (app, _, pilot):
        app.push_screen(PlanDialog(PlanOptions(), Vehicle()))
        await pilot.pause()
        buttons = {button.name: button for button in app.screen.query("#method Choice").results(Choice)}
        assert tuple(buttons) == METHODS.names()
        seen = {}
        for name, button in buttons.items():
            button.value = True
            await pilot.pause()
            fields = (app.screen.query_one(f"#{field}", Input) for field in ("kappa_max_1pm", "sigma_max_1pm2"))
            seen[name] = tuple(field.placeholder for field in fields)
        assert seen["g2"] == ("by the wheels", "by the wheels")
        assert seen["ccd"] == seen["dubins-padded"] == ("1.125", "2.1")
        assert seen["roundabout"] == ("half the others'", "2.1")


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    for arguments in (["plan", "study-square", "--method", "lqr"], ["simulate", "study-square", "--follower", "lqr"]):
        result = CliRunner().invoke(app, arguments, env={"COLUMNS": "200"})
        assert result.exit_code == 2
        assert "is 'lqr'; give '" in result.output
    with pytest.raises(
        UnknownPlugin, match=r"give 'mpc', 'pure-pursuit', .*, 'external', 'external-timed', 'outsider' or 'dawdler'"
    ):
        make_follower("lqr", Vehicle())
    with pytest.raises(ValueError, match="already"):
        FOLLOWERS.register("mpc", "", Outsider)


def test_all_that_is_shipped_is_where_it_is_said_to_be() -> None:
    for name in ("mpc", "pure-pursuit", "pursuit-lanes", "external"):
        assert make_follower(name, Vehicle()).name == name
    for name in ("g2", "ccd", "dubins-padded"):
        options = PlanOptions(method=name)
        assert {turns.method.name for turns in method_of(options).transitions(Limits.of(Vehicle(), options)).turns} == {
            name
        }


def test_what_makes_a_plugin_may_be_given_or_found() -> None:
    registry: Registry[float] = Registry("number")
    registry.register("pi", "from elsewhere", "math:pi")
    registry.register("two", "given", 2.0)
    assert registry.default == "pi"
    assert [round(registry.find(name), 2) for name in registry.names()] == [3.14, 2.0]
