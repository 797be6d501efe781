"""Address and permissions of the viewers' server."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
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
        certificate, key: Files of TLS (PEM), if given.
        token: File of the token that viewers present, if given.
        identity: Name or folder of the identity in whose name viewers ask on a secured bus; empty if none is given.
    """

    address: str = DEFAULT_ADDRESS
    clock: bool = False
    orders: bool = False
    origins: tuple[str, ...] = ()
    certificate: Path | None = None
    key: Path | None = None
    token: Path | None = None
    identity: str = ""

    def __post_init__(self) -> None:
        """Refuse an invalid address or origin, and half of what TLS takes.

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
        if (self.certificate is None) != (self.key is None):
            given, other = "--foxglove-cert", "--foxglove-key"
            if self.certificate is None:
                given, other = other, given
            raise SpecError("command line", given, f"is given without {other}", f"give {other}, too")

    @property
    def host(self) -> str:
        """Host, without the brackets of IPv6."""
        return self.address.rpartition(":")[0].strip("[]")

    @property
    def port(self) -> int:
        """Port number."""
        return int(self.address.rpartition(":")[2])

    def arguments(self) -> list[str]:
        """Options that pass this to ``touchline bridge``."""
        flags = [*(["--clock"] if self.clock else []), *(["--foxglove-orders"] if self.orders else [])]
        options = {
            "--foxglove-cert": self.certificate,
            "--foxglove-key": self.key,
            "--foxglove-token": self.token,
            "--viewer-identity": self.identity,
        }
        values = [*(("--foxglove-origin", origin) for origin in self.origins), *options.items()]
        given = [part for option, value in values if value for part in (option, str(value))]
        return ["--foxglove", "--foxglove-listen", self.address, *flags, *given]
