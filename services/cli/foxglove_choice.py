"""The options of the viewers' server, which ``touchline bridge`` and ``touchline up`` share."""

import os
import socket
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.schemas.errors import SpecError
from touchline.schemas.optional_packages import require

if TYPE_CHECKING:  # every process starts through this command line, and few need the server
    from touchline.services.bridge.foxglove import FoxgloveConfig
    from touchline.services.bridge.gateway import GatewayConfig


@dataclass(frozen=True)
class FoxgloveChoice:
    """Whether and where Foxglove, Lichtblick and other viewers see the robots."""

    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Serve viewers that speak Foxglove's protocol: Foxglove, Lichtblick.")
    ] = False
    foxglove_listen: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Serve them at this address; default 127.0.0.1:8765. Whoever reaches it can command the robots.",
            show_default=False,
        ),
    ] = ""
    clock: Annotated[
        bool,
        typer.Option("--clock", help="Tell viewers and ROS 2 nodes the first robot's sim time as /clock, too."),
    ] = False

    def server(self) -> "FoxgloveConfig | None":
        """The server that is asked for, if one is.

        Raises:
            SpecError: The address is none, or given without the server.
            TouchlineError: The server's package is not installed.
        """
        if not self.foxglove:
            if self.foxglove_listen:
                problem = f"is {self.foxglove_listen!r}"
                raise SpecError("command line", "--foxglove-listen", problem, "give --foxglove, too")
            return None
        require("foxglove", "--foxglove")
        from touchline.services.bridge.foxglove import DEFAULT_ADDRESS, FoxgloveConfig

        return FoxgloveConfig(self.foxglove_listen or DEFAULT_ADDRESS, self.clock)

    def check_free(self) -> None:
        """Refuse an address that somebody else listens on, before anything is started.

        Raises:
            SpecError: It cannot be listened on.
        """
        server = self.server()
        if server is None:
            return
        try:
            family = socket.AF_INET6 if ":" in server.host else socket.AF_INET
            socket.create_server((server.host, server.port), family=family).close()
        except OSError as error:
            problem = f"is {server.address}, where it cannot listen ({os.strerror(error.errno or 0)})"
            raise SpecError("command line", "--foxglove-listen", problem, "give another address") from error

    def told(self) -> str:
        """Where viewers find the robots, for who starts them; empty without the server."""
        server = self.server()
        return f"Foxglove and Lichtblick find it at {server.url}" if server is not None else ""

    def with_clock(self, gateway: "GatewayConfig | None") -> "GatewayConfig | None":
        """The gateway to ROS 2, if there is one, with the clock if that is asked for.

        Raises:
            SpecError: The clock is asked for, and there is nobody to tell it.
        """
        if self.clock and gateway is None and not self.foxglove:
            raise SpecError("command line", "--clock", "has nobody to tell", "give --foxglove or --ros2, too")
        return replace(gateway, clock=self.clock) if gateway is not None else None
