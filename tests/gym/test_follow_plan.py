"""Environments: Gymnasium's checks, the bits of a simulation, robots in step as alone, ends and refusals."""

import hashlib
import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import touchline
import touchline.gym
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.schemas.faults import parse_fault

NAME = "touchline/FollowPlan-v0"
BUMPER = touchline.Scenario(faults=(parse_fault('{"kind": "bumper", "start_s": 2.0, "duration_s": 1.0}'),))


@pytest.fixture(scope="module")
def plan() -> touchline.Plan:
    return touchline.plan("study-square")


def follow(observation: np.ndarray) -> np.ndarray:
    """Correction of the planned yaw rate."""
    off = observation[..., 0] / 0.35 + observation[..., 1]
    return np.stack((np.zeros_like(off), -2.0 * off), -1).clip(-1.0, 1.0).astype(np.float32)


@pytest.mark.parametrize(
    "options", [{}, {"action": "residual", "observation": "truth"}, {"action": "actuators", "ticks": 1}]
)
def test_gymnasium_finds_nothing_to_warn_of(plan: touchline.Plan, options: dict[str, Any]) -> None:
    check_env(gymnasium.make(NAME, plan=plan, render_mode="rgb_array", **options).unwrapped)


def test_an_action_does_what_a_follower_does(plan: touchline.Plan) -> None:
    lead = lead_ticks(drive_of(plan.vehicle).lag_s)
    env = gymnasium.make(NAME, plan=plan, action="residual", ticks=1)
    _, info = env.reset(seed=3)
    run = touchline.simulate(
        plan, seed=info["seed"], follower=lambda state, ahead: (ahead.speed_mps[lead], ahead.yaw_rate_radps[lead])
    )
    rows = run.frame(kind="numpy")
    ended, steps = False, 0
    while not ended:
        _, reward, ended, truncated, info = env.step(np.zeros(2, np.float32))
        steps += 1
        assert not truncated and reward <= 0.01
    # Without feedback the robot leaves its line, and pauses.
    paused = int(np.flatnonzero(rows["state"] == "paused")[0]) + 1  # with the next question
    assert info["events"] == ("paused",) and "off its line" in info["reason"] and 0.0 < info["coverage_pct"] < 100.0
    assert [rows[f"truth_{name}"][paused] for name in ("x_m", "y_m", "heading_rad")] == info["truth"][:3].tolist()
    assert abs(info["lateral_m"] - rows["lateral_error_m"][paused]) < 1e-3
    assert steps <= paused


def test_a_policy_drives_to_the_end(plan: touchline.Plan) -> None:
    env = gymnasium.make(NAME, plan=plan, action="residual", observation="truth")  # a burst is no fault of the policy
    observation, _ = env.reset(seed=3)
    ended, earned, seconds = False, 0.0, 0.0
    while not ended:
        observation, reward, ended, _, info = env.step(follow(observation))
        assert env.observation_space.contains(observation)
        earned, seconds = earned + float(reward), seconds + 0.05
    assert info["reason"] == "" and info["coverage_pct"] > 99.0
    assert 0.0 < earned < seconds


def test_robots_in_step_drive_as_alone(plan: touchline.Plan) -> None:
    """Also through the ends of episodes, which come early and at different times, and in several threads."""
    options: dict[str, Any] = {"plan": plan, "action": "residual", "limit_m": 0.03, "max_time_s": 9.0}
    many = gymnasium.make_vec(NAME, num_envs=3, threads=2, **options)
    alone = [gymnasium.make(NAME, **options) for _ in range(3)]
    random = np.random.default_rng(1)
    observations, infos = many.reset(seed=5)
    for i, env in enumerate(alone):
        observation, info = env.reset(seed=5 + i)
        assert (observation == observations[i]).all() and info["seed"] == infos["seed"][i]
    ended = np.zeros(3, dtype=bool)
    kinds = set()
    for _ in range(400):
        actions = (follow(observations) + random.normal(0.0, 0.3, (3, 2))).clip(-1.0, 1.0).astype(np.float32)
        observations, rewards, terminated, truncated, infos = many.step(actions)
        for i, env in enumerate(alone):
            if ended[i]:
                observation, info = env.reset()
                assert info["seed"] == infos["seed"][i] and rewards[i] == 0.0
                assert not terminated[i] and not truncated[i]
            else:
                observation, *rest, info = env.step(actions[i])
                assert rest == [rewards[i], terminated[i], truncated[i]]
                assert info["lateral_m"] == infos["lateral_m"][i] and infos["_lateral_m"][i]
            assert (observation == observations[i]).all()
        ended = terminated | truncated
        kinds |= {"terminated"} if terminated.any() else set()
        kinds |= {"truncated"} if truncated.any() else set()
    assert kinds == {"terminated", "truncated"}


def test_the_same_seed_and_actions_give_the_same_bytes(plan: touchline.Plan) -> None:
    def digest(seed: int) -> str:
        env = gymnasium.make(NAME, plan=plan, action="actuators", ticks=2)
        env.action_space.seed(1)
        found = hashlib.sha256(env.reset(seed=seed)[0].tobytes())
        for _ in range(200):
            observation, reward, ended, *_ = env.step(env.action_space.sample())
            found.update(observation.tobytes() + np.float64(reward).tobytes())
            if ended:
                found.update(env.reset()[0].tobytes())
        return found.hexdigest()

    assert digest(4) == digest(4) != digest(5)


def test_an_episode_ends_with_a_stop_of_the_robot(plan: touchline.Plan) -> None:
    env = gymnasium.make(NAME, plan=plan, scenario=BUMPER, action="residual")
    observation, _ = env.reset(seed=1)
    for _ in range(100):
        observation, _, ended, _, info = env.step(follow(observation))
        if ended:
            break
    assert info["reason"] == "the bumper is pressed" and info["events"] == ("fault-begins", "emergency-stopped")


def test_what_cannot_be_is_refused(plan: touchline.Plan) -> None:
    env = gymnasium.make(NAME, plan=plan, disable_env_checker=True)
    env.reset(seed=1)
    with pytest.raises(touchline.SpecError, match=r"give an array of shape \(2,\)"):
        env.step(np.zeros(3, np.float32))
    with pytest.raises(touchline.SpecError, match="action is not finite"):
        env.step(np.array([0.0, np.nan], np.float32))
    many = gymnasium.make_vec(NAME, num_envs=2, plan=plan)
    many.reset(seed=1)
    with pytest.raises(touchline.SpecError, match=r"give an array of shape \(2, 2\)"):
        many.step(np.zeros((2, 3), np.float32))
    with pytest.raises(touchline.SpecError, match="did you mean 'limit_m'"):
        gymnasium.make(NAME, plan=plan, limit=0.3)
    with pytest.raises(touchline.SpecError, match="ticks"):
        gymnasium.make(NAME, plan=plan, ticks=0)
    with pytest.raises(touchline.SpecError, match="threads"):
        gymnasium.make_vec(NAME, num_envs=2, plan=plan, threads=0)


def test_without_gymnasium_the_import_names_the_package() -> None:
    code = "import sys; sys.modules['gymnasium'] = None; import touchline.gym"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install 'gymnasium>=1.0'" in done.stderr
