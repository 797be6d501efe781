"""Command the robot from ROS 2's side, with a client that is none of ours: zenoh-ros2-sdk.

    touchline up --ros2                       # in one terminal
    python examples/ros2_client.py pause      # in another

It lists what it discovers, then calls one of the services of `touchline_msgs/srv/Command`: start, pause, resume,
abort, estop or reset. `pip install zenoh-ros2-sdk` is all that it needs beside our message definitions.
"""

import argparse
import os
import time
from pathlib import Path

os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")  # it asks for git when it is imported; here it needs none

import zenoh_ros2_sdk as sdk

CONNECT_TIMEOUT_S = 20.0
DEFINITIONS = Path(__file__).resolve().parents[1] / "schemas" / "msg"


def main() -> None:
    """List topics and services, then call the chosen service."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["start", "pause", "resume", "abort", "estop", "reset"])
    parser.add_argument("--port", type=int, default=7447)
    parser.add_argument("--namespace", default="/tt2")
    options = parser.parse_args()
    router = {"router_ip": "127.0.0.1", "router_port": options.port}
    sdk.get_registry(str(DEFINITIONS))
    deadline_s = time.monotonic() + CONNECT_TIMEOUT_S
    while not (topics := sdk.get_topic_names_and_types(**router)) and time.monotonic() < deadline_s:
        time.sleep(0.1)
    for name, (kind, *_) in topics:
        print(f"{name}  {kind}")
    caller = sdk.ROS2ServiceClient(
        f"{options.namespace.rstrip('/')}/traversal/{options.command}", "touchline_msgs/srv/Command", **router
    )
    answer = caller.call(request_id="")
    print("no answer" if answer is None else f"{options.command}: {answer.success}, {answer.message}")
    caller.session_mgr.close()


if __name__ == "__main__":
    main()
