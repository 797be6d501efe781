"""The gateway's options: what they mean, and what is refused before anything is started."""

import os
import socket
import subprocess
import sys
from typing import Any

import pytest

from touchline.bus import BusConfig
from touchline.bus.ros2 import DEFAULT_ENDPOINT, Ros2Endpoint, Ros2Session
from touchline.cli.ros2_choice import Ros2Choice
from touchline.schemas.errors import SpecError
from touchline.services.bridge.gateway import GatewayConfig


def test_without_ros2_there_is_no_gateway() -> None:
    assert Ros2Choice(False, 3, "", "", "").gateway() is None


def test_by_default_it_is_the_router_on_loopback() -> None:
    assert Ros2Choice(True, 0, "", "", "").gateway() == GatewayConfig(
        Ros2Endpoint(DEFAULT_ENDPOINT, listen=True), 0, ""
    )
    assert DEFAULT_ENDPOINT.startswith("tcp/127.0.0.1:")


def test_it_joins_a_router_that_is_named() -> None:
    config = Ros2Choice(True, 7, "/a/b", "", "tcp/10.0.0.1:7447").gateway()
    assert config == GatewayConfig(Ros2Endpoint("tcp/10.0.0.1:7447", listen=False), 7, "/a/b")


def test_a_system_hands_all_of_it_to_its_bridge() -> None:
    config = Ros2Choice(True, 0, "", "", "", ["clock", "plan*"], ["traversal/*"], "gateway.main").gateway()
    assert config is not None
    assert config.arguments()[7:] == [
        *("--ros2-topics", "clock", "--ros2-topics", "plan*", "--ros2-services", "traversal/*"),
        *("--gateway-identity", "gateway.main"),
    ]


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ((False, 0, "", "tcp/a:1", ""), "--ros2-listen is 'tcp/a:1'; give --ros2"),
        ((False, 0, "", "", "tcp/a:1"), "--ros2-connect is 'tcp/a:1'; give --ros2"),
        ((False, 0, "x", "", ""), "--ros-namespace is 'x'; give --ros2"),
        ((False, 0, "", "", "", ["clock"]), "--ros2-topics is 'clock'; give --ros2"),
        ((False, 0, "", "", "", None, ["a", "b"]), "--ros2-services is 'a, b'; give --ros2"),
        ((False, 0, "", "", "", None, None, "gateway.main"), "--gateway-identity is 'gateway.main'; give --ros2"),
        ((True, 0, "", "tcp/a:1", "tcp/a:2"), "--ros2-connect is 'tcp/a:2'; give it or --ros2-listen, not both"),
        ((True, 0, "2nd", "", ""), "--ros-namespace is '2nd'"),
        ((True, 0, "", "7447", ""), "--ros2-listen is '7447'; give a locator like"),
        (
            (True, 0, "", "", "", ["odometry/filterd"]),
            "--ros2-topics is 'odometry/filterd', which matches nothing; did you mean 'odometry/filtered'?",
        ),
        (
            (True, 0, "", "", "", None, ["traversal/pause", "/tt2/*"]),
            "--ros2-services is '/tt2/*', which matches nothing; see `touchline topics` for the names",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused_by_its_name(given: tuple[Any, ...], named: str) -> None:
    with pytest.raises(SpecError) as refusal:
        Ros2Choice(*given).gateway()
    assert named in str(refusal.value)


def test_a_bridge_whose_endpoint_is_taken_ends_with_one_line_that_names_the_option(bus_config: BusConfig) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    command = [sys.executable, "-m", "touchline", "bridge", "--ros2", "--ros2-listen", endpoint]
    with Ros2Session.open(Ros2Endpoint(endpoint)):
        done = subprocess.run(
            command,
            env={**os.environ, **bus_config.environment()},
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: --ros2-listen {endpoint}: cannot listen there")
    assert done.stderr.count("\n") == 1
