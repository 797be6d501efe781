"""Options of the ROS 2 gateway, shared by ``touchline bridge`` and ``touchline up``."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.schemas.errors import SpecError

if TYPE_CHECKING:  # every process starts through this command line, and few need the gateway
    from touchline.services.bridge.gateway import GatewayConfig


@dataclass(frozen=True)
class Ros2Choice:
    """Gateway for ROS 2 nodes."""

    ros2: Annotated[
        bool,
        typer.Option("--ros2", help="Offer topics and services to ROS 2 nodes that use rmw_zenoh (Jazzy and later)."),
    ] = False
    ros_domain: Annotated[
        int, typer.Option(metavar="N", help="ROS domain id.", envvar="ROS_DOMAIN_ID", min=0, max=232)
    ] = 0
    ros_namespace: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="ROS namespace of all names; `/`: none (default: the robot's).", show_default=False
        ),
    ] = ""
    ros2_listen: Annotated[
        str,
        typer.Option(
            metavar="LOCATOR",
            help="Locator of our Zenoh router for ROS 2 nodes (default: tcp/127.0.0.1:7447).",
            show_default=False,
        ),
    ] = ""
    ros2_connect: Annotated[
        str,
        typer.Option(
            metavar="LOCATOR", help="Join the Zenoh router (rmw_zenohd) at this locator instead.", show_default=False
        ),
    ] = ""

    ros2_topics: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Publish only topics whose names match, such as `odometry/*`; may be repeated.",
        ),
    ] = None
    ros2_services: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Offer only services whose names match, such as `traversal/estop`; may be repeated (default on a "
            "secured bus: those that change nothing).",
        ),
    ] = None
    gateway_identity: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Identity in whose name ROS 2 nodes command on a secured bus (default with --secure: gateway.main).",
            show_default=False,
        ),
    ] = ""

    def notice(self, robots: Sequence[str]) -> str:
        """Return lines for the user on how ROS 2 nodes connect; empty without the gateway.

        Args:
            robots: Namespaces of the robots.
        """
        gateway = self.gateway()
        if gateway is None:
            return ""
        names = [gateway.of(robot, alone=len(robots) == 1).namespace.strip("/") for robot in robots]
        shown = f"{'it' if len(robots) == 1 else 'them'} under {', '.join(f'/{name}' for name in names)}"
        lines = [
            f"ROS 2 nodes find {shown}, through the Zenoh router at {gateway.endpoint.locator}:",
            "  export RMW_IMPLEMENTATION=rmw_zenoh_cpp",
            f"  export ROS_DOMAIN_ID={gateway.domain}",
            f"  export ZENOH_CONFIG_OVERRIDE='connect/endpoints=[\"{gateway.endpoint.locator}\"]'",
        ]
        return "\n".join(lines)

    def gateway(self) -> "GatewayConfig | None":
        """Return the requested gateway, if any.

        Raises:
            SpecError: An option contradicts another, or is not usable.
        """
        listen, connect = self.ros2_listen, self.ros2_connect
        if not self.ros2:
            given = {
                "--ros2-listen": listen,
                "--ros2-connect": connect,
                "--ros-namespace": self.ros_namespace,
                "--ros2-topics": ", ".join(self.ros2_topics or ()),
                "--ros2-services": ", ".join(self.ros2_services or ()),
                "--gateway-identity": self.gateway_identity,
            }
            for name, value in given.items():
                if value:
                    raise SpecError("command line", name, f"is {value!r}", "give --ros2, too")
            return None
        if listen and connect:
            raise SpecError("command line", "--ros2-connect", f"is {connect!r}", "give it or --ros2-listen, not both")
        from touchline.bus.ros2 import DEFAULT_ENDPOINT, Ros2Endpoint
        from touchline.services.bridge.gateway import GatewayConfig

        endpoint = Ros2Endpoint(connect, listen=False) if connect else Ros2Endpoint(listen or DEFAULT_ENDPOINT)
        return GatewayConfig(
            endpoint,
            self.ros_domain,
            self.ros_namespace,
            topics=tuple(self.ros2_topics or ()),
            services=tuple(self.ros2_services or ()),
            identity=self.gateway_identity,
        )
