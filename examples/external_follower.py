"""External path follower, outside the robot: serves `follower/step`, in lock-step with sim time.

Run it beside a robot that waits for it:

    python examples/external_follower.py &
    touchline run soccer-11 --follower external

Any language will do that speaks Zenoh and CDR: declare a queryable on `<namespace>/follower/step` and answer each
request (schemas/msg/touchline_msgs/srv/FollowerStep.srv) with the wanted speed, yaw rate and the request's `step`.
"""

from __future__ import annotations

from collections.abc import Callable

from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.messages import FollowerStepRequest, FollowerStepResponse

LOOKAHEAD_M = 0.35
LEAD_TICKS = 5
"""Look-ahead that compensates the actuators' lag of 50 ms."""

Controller = Callable[[FollowerStepRequest], tuple[float, float]]


def steer(request: FollowerStepRequest) -> tuple[float, float]:
    """Feed the path forward, and steer the errors out over a lookahead: speed [m/s] and yaw rate [rad/s]."""
    speed = request.ahead_speed_mps[LEAD_TICKS]
    sense = 1.0 if speed >= 0.0 else -1.0
    turn = -2.0 * (sense * request.lateral_m / LOOKAHEAD_M + request.heading_error_rad) / LOOKAHEAD_M
    return speed, request.ahead_yaw_rate_radps[LEAD_TICKS] + abs(speed) * turn


def serve(bus: Bus, controller: Controller, stop: Callable[[], bool]) -> None:
    """Answer requests by `controller` until `stop` returns true."""
    server = bus.serve(topics.FOLLOWER_STEP)
    while not stop():
        call = server.wait(0.1)
        if call is not None:
            speed_mps, yaw_rate_radps = controller(call.request)
            step = call.request.step
            call.reply(FollowerStepResponse(step=step, speed_mps=speed_mps, yaw_rate_radps=yaw_rate_radps))


def main() -> None:
    """Run the follower until it is interrupted."""
    with Bus.open("follower") as bus:
        serve(bus, steer, lambda: False)


if __name__ == "__main__":
    main()
