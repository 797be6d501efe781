"""Steps per second of the Gymnasium environments, with highway-env beside them if it is installed.

`python -m benchmarks gym_steps`; each environment is stepped for `seconds` with a policy that keeps it on the plan,
resets included, or with random actions. Figures are by processor time, which other programs disturb less; those of
several threads by wall time.
"""

import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np

import touchline
import touchline.gym
from benchmarks._settings import Small

NAME = "touchline/FollowPlan-v0"
SMALL = Small(
    {"template": "study-square", "seconds": 0.05, "robots": 4},
    (
        "one robot, 10 ms a step # steps/s",
        "one robot, 50 ms a step # steps/s",
        "4 robots, 10 ms a step # steps/s",
        "reset # ms",
    ),
)


def main(template: str = "tennis", seconds: float = 5.0, robots: int = 64) -> None:
    """Print the figures."""
    plan = touchline.plan(template)
    options: dict[str, Any] = {"plan": plan, "action": "residual", "ticks": 1}
    env: Any = gymnasium.make(NAME, **options, disable_env_checker=True).unwrapped
    _print("one robot, 10 ms a step", _alone(env, seconds, _follow))
    slower: Any = gymnasium.make(NAME, **{**options, "ticks": 5}, disable_env_checker=True).unwrapped
    _print("one robot, 50 ms a step", _alone(slower, seconds, _follow))
    many: Any = gymnasium.make_vec(NAME, num_envs=robots, **options)
    _print(f"{robots} robots, 10 ms a step", _together(many, seconds, time.process_time))
    many = gymnasium.make_vec(NAME, num_envs=robots, threads=2, **options)
    _print(f"{robots} robots, 10 ms a step, two threads, wall time", _together(many, seconds, time.perf_counter))
    begun_s = time.process_time()
    for seed in range(10):
        env.reset(seed=seed)
    print(f"{'reset':56} {1e2 * (time.process_time() - begun_s):9.2f} ms")
    if find_spec("highway_env") is not None:
        _highway(seconds)


def _highway(seconds: float) -> None:
    import highway_env  # type: ignore[import-not-found, unused-ignore]

    gymnasium.register_envs(highway_env)
    for name in ("lane-keeping-v0", "parking-v0", "highway-fast-v0"):
        env: Any = gymnasium.make(name, disable_env_checker=True).unwrapped
        _print(f"highway-env {name}", _alone(env, seconds, partial(_any_action, env.action_space)))


def _print(name: str, rate: float) -> None:
    print(f"{name:56} {rate:9.0f} steps/s", flush=True)


def _any_action(space: Any, _: Any) -> Any:
    return space.sample()


def _follow(observation: Any) -> Any:
    """Correction of the planned yaw rate."""
    return np.array((0.0, -2.0 * (observation[0] / 0.35 + observation[1])), np.float32)


def _alone(env: Any, seconds: float, policy: Callable[[Any], Any]) -> float:
    """Steps per second of processor time."""
    observation, _ = env.reset(seed=1)
    begun_s, steps = time.process_time(), 0
    while (spent_s := time.process_time() - begun_s) < seconds:
        observation, _, terminated, truncated, _ = env.step(policy(observation))
        if terminated or truncated:
            observation, _ = env.reset()
        steps += 1
    return steps / spent_s


def _together(env: Any, seconds: float, clock: Callable[[], float]) -> float:
    """Steps per second of all robots together."""
    observations, _ = env.reset(seed=1)
    actions = np.zeros(env.action_space.shape, np.float32)
    begun_s, steps = clock(), 0
    while (spent_s := clock() - begun_s) < seconds:
        actions[:, 1] = -2.0 * (observations[:, 0] / 0.35 + observations[:, 1])
        observations, *_ = env.step(actions)
        steps += env.num_envs
    return steps / spent_s
