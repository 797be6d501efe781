"""Address and permissions of the viewers' server."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from touchline.schemas.errors import SpecError
from touchline.services.bridge.foxglove.viewer_origins import is_origin

DEFAULT_ADDRESS: Final = "127.0.0.1:8765"
_MOST_PORT: Final = 65535


@dataclass(frozen=True)
class FoxgloveConfig:
    """Address and permissions of the viewers' server.

    Attributes:
        address: ``HOST:PORT`` of this machine; port 0: any free one.
        clock: Whether the first robot's sim time is published as ``/clock``.
        orders: Whether viewers may command the robots, recordings and replays.
        origins: Web pages that may connect, beside those of `is_allowed`.
    """

    address: str = DEFAULT_ADDRESS
    clock: bool = False
    orders: bool = False
    origins: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse an invalid address or origin.

        Raises:
            SpecError: It is invalid.
        """
        host, _, port = self.address.rpartition(":")
        if not host or not port.isascii() or not port.isdigit() or int(port) > _MOST_PORT:
            remedy = f"give HOST:PORT, such as {DEFAULT_ADDRESS}, or 0.0.0.0:8765 for viewers on other machines"
            raise SpecError("command line", "--foxglove-listen", f"is {self.address!r}", remedy)
        for origin in self.origins:
            if not is_origin(origin):
                remedy = "give it as browsers send it, such as https://viewer.example or http://viewer.example:8080"
                raise SpecError("command line", "--foxglove-origin", f"is {origin!r}", remedy)

    @property
    def host(self) -> str:
        """Host, without the brackets of IPv6."""
        return self.address.rpartition(":")[0].strip("[]")

    @property
    def port(self) -> int:
        """Port number."""
        return int(self.address.rpartition(":")[2])

    @property
    def url(self) -> str:
        """URL at which viewers connect."""
        return f"ws://{self.address}"

    def arguments(self) -> list[str]:
        """Options that pass this to ``touchline bridge``."""
        flags = [*(["--clock"] if self.clock else []), *(["--foxglove-orders"] if self.orders else [])]
        origins = [part for origin in self.origins for part in ("--foxglove-origin", origin)]
        return ["--foxglove", "--foxglove-listen", self.address, *flags, *origins]
