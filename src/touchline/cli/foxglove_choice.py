"""Options of the viewers' server, shared by ``touchline bridge`` and ``touchline up``."""

import os
import socket
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.schemas.errors import SpecError
from touchline.schemas.optional_packages import require

if TYPE_CHECKING:  # every process starts through this command line, and few need the server
    from touchline.services.bridge.foxglove import FoxgloveConfig, ViewerAccess
    from touchline.services.bridge.gateway import GatewayConfig


@dataclass(frozen=True)
class FoxgloveChoice:
    """Server for Foxglove, Lichtblick and other viewers."""

    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Serve viewers with Foxglove's protocol: Foxglove, Lichtblick.")
    ] = False
    foxglove_listen: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Address of the server (default: 127.0.0.1:8765, this machine only).",
            show_default=False,
        ),
    ] = ""
    foxglove_orders: Annotated[
        bool, typer.Option("--foxglove-orders", help="Let viewers command robots, recordings and replays.")
    ] = False
    foxglove_origin: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ORIGIN", help="Accept web pages of this origin, such as https://viewer.example; may be repeated."
        ),
    ] = None
    foxglove_cert: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="TLS certificate with its chain, PEM: viewers connect by wss:// (default beyond this machine: that of "
            "--viewer-identity).",
            show_default=False,
        ),
    ] = None
    foxglove_key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Private key of that certificate, PEM.", show_default=False)
    ] = None
    foxglove_token: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Require the token in this file, which is made if it is missing (default on a secured bus, and with "
            "TLS beyond this machine: one in the folder of keys).",
            show_default=False,
        ),
    ] = None
    viewer_identity: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Identity in whose name viewers command on a secured bus (default with --secure: viewer.main).",
            show_default=False,
        ),
    ] = ""
    clock: Annotated[
        bool, typer.Option("--clock", help="Publish the first robot's sim time as /clock to viewers and ROS 2 nodes.")
    ] = False

    def server(self) -> "FoxgloveConfig | None":
        """Return the requested server, if any.

        Raises:
            SpecError: The address or origin is invalid, or given without the server.
            TouchlineError: The server's package is not installed.
        """
        if not self.foxglove:
            beside = (
                ("--foxglove-listen", self.foxglove_listen),
                ("--foxglove-orders", self.foxglove_orders),
                ("--foxglove-origin", self.foxglove_origin),
                ("--foxglove-cert", self.foxglove_cert),
                ("--foxglove-key", self.foxglove_key),
                ("--foxglove-token", self.foxglove_token),
                ("--viewer-identity", self.viewer_identity),
            )
            for option, given in beside:
                if given:
                    raise SpecError("command line", option, "is given without a server", "give --foxglove, too")
            return None
        require("foxglove", "--foxglove")
        from touchline.services.bridge.foxglove import DEFAULT_ADDRESS, FoxgloveConfig

        return FoxgloveConfig(
            self.foxglove_listen or DEFAULT_ADDRESS,
            self.clock,
            self.foxglove_orders,
            tuple(self.foxglove_origin or ()),
            self.foxglove_cert and self.foxglove_cert.absolute(),
            self.foxglove_key and self.foxglove_key.absolute(),
            self.foxglove_token and self.foxglove_token.absolute(),
            self.viewer_identity,
        )

    def check_free(self) -> None:
        """Refuse an address that is in use, before anything is started.

        Raises:
            SpecError: The address cannot be listened on.
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

    def notice(self, access: "ViewerAccess") -> str:
        """Return a line for the user with the server's address; empty without the server.

        Args:
            access: Requirements of the server for viewers.
        """
        server = self.server()
        if server is None:
            return ""
        host, _, port = server.address.rpartition(":")
        allowed = "" if server.orders else " (read-only; --foxglove-orders lets them command)"
        return f"Foxglove and Lichtblick find it at {access.url(host, int(port))}{access.hint()}{allowed}"

    def with_clock(self, gateway: "GatewayConfig | None") -> "GatewayConfig | None":
        """Return the gateway to ROS 2, if any, with the clock if requested.

        Raises:
            SpecError: The clock is requested without a server or gateway.
        """
        if self.clock and gateway is None and not self.foxglove:
            raise SpecError(
                "command line", "--clock", "is given without --foxglove or --ros2", "give --foxglove or --ros2, too"
            )
        return replace(gateway, clock=self.clock) if gateway is not None else None
