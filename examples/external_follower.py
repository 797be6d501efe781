"""A path follower of one's own, outside the robot: serves `follower/step`, in lock-step with sim time.

Run it beside a robot that waits for it:

    python examples/external_follower.py &
    touchline run soccer-11 --follower external

Any language will do that speaks Zenoh and CDR: declare a queryable on `<namespace>/follower/step` and answer each
request (schemas/msg/touchline_msgs/srv/FollowerStep.srv) with the wheel speeds and the request's `step`.
"""

from __future__ import annotations

from collections.abc import Callable

from touchline.schemas import topics
from touchline.schemas.messages import FollowerStepRequest, FollowerStepResponse
from touchline.services.bus import Bus

HALF_TRACK_M = 0.25395
LOOKAHEAD_M = 0.35
LEAD_TICKS = 5
"""The motors lag by 50 ms."""

Controller = Callable[[FollowerStepRequest], tuple[float, float]]


def steer(request: FollowerStepRequest) -> tuple[float, float]:
    """Feed the path forward, and steer the errors out over a lookahead: wheel speeds (left, right) [rad/s]."""
    speed = request.ahead_speed_mps[LEAD_TICKS]
    sense = 1.0 if speed >= 0.0 else -1.0
    turn = -2.0 * (sense * request.lateral_m / LOOKAHEAD_M + request.heading_error_rad) / LOOKAHEAD_M
    yaw_rate = request.ahead_yaw_rate_radps[LEAD_TICKS] + abs(speed) * turn
    left = (speed - HALF_TRACK_M * yaw_rate) / request.left_radius_m
    right = (speed + HALF_TRACK_M * yaw_rate) / request.right_radius_m
    return left, right


def serve(bus: Bus, controller: Controller, stop: Callable[[], bool]) -> None:
    """Answer until `stop`."""
    server = bus.serve(topics.FOLLOWER_STEP)
    while not stop():
        call = server.wait(0.1)
        if call is not None:
            left, right = controller(call.request)
            call.reply(FollowerStepResponse(step=call.request.step, left_radps=left, right_radps=right))


def main() -> None:
    """Serve until interrupted."""
    with Bus.open("follower") as bus:
        serve(bus, steer, lambda: False)


if __name__ == "__main__":
    main()
