"""The options of the ROS 2 gateway, which ``touchline bridge`` and ``touchline up`` share."""

from typing import Annotated

import typer

from schemas.errors import SpecError
from services.bridge.gateway import GatewayConfig
from services.bus.ros2 import DEFAULT_ENDPOINT, Ros2Endpoint

Ros2Option = Annotated[
    bool, typer.Option("--ros2", help="Show topics and services to ROS 2 nodes that use rmw_zenoh (Jazzy and later).")
]
RosDomainOption = Annotated[int, typer.Option(help="ROS domain id.", envvar="ROS_DOMAIN_ID", min=0, max=232)]
RosNamespaceOption = Annotated[
    str, typer.Option(help="ROS namespace of all names; `/` for none; default: the robot's.", show_default=False)
]
Ros2ListenOption = Annotated[
    str,
    typer.Option(
        help=f"Be the Zenoh router that ROS 2 nodes connect to, at this locator; default {DEFAULT_ENDPOINT}.",
        show_default=False,
    ),
]
Ros2ConnectOption = Annotated[
    str, typer.Option(help="Join the Zenoh router (rmw_zenohd) at this locator instead.", show_default=False)
]


def gateway_config(enabled: bool, domain: int, namespace: str, listen: str, connect: str) -> GatewayConfig | None:
    """The gateway that is asked for, if one is.

    Raises:
        SpecError: An option contradicts another, or cannot be used.
    """
    if not enabled:
        given = {"--ros2-listen": listen, "--ros2-connect": connect, "--ros-namespace": namespace}
        for name, value in given.items():
            if value:
                raise SpecError("command line", name, f"is {value!r}", "give --ros2, too")
        return None
    if listen and connect:
        raise SpecError("command line", "--ros2-connect", f"is {connect!r}", "give it or --ros2-listen, not both")
    endpoint = Ros2Endpoint(connect, listen=False) if connect else Ros2Endpoint(listen or DEFAULT_ENDPOINT)
    return GatewayConfig(endpoint, domain, namespace)
