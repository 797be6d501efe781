"""Where viewers are served."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from touchline.schemas.errors import SpecError

DEFAULT_ADDRESS: Final = "127.0.0.1:8765"
_MOST_PORT: Final = 65535


@dataclass(frozen=True)
class FoxgloveConfig:
    """Where viewers are served.

    Attributes:
        address: ``HOST:PORT`` of this machine; port 0 is any that is free.
        clock: Whether the first robot's sim time is told as ``/clock``, too.
    """

    address: str = DEFAULT_ADDRESS
    clock: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no address.

        Raises:
            SpecError: It is none.
        """
        host, _, port = self.address.rpartition(":")
        if not host or not port.isascii() or not port.isdigit() or int(port) > _MOST_PORT:
            remedy = f"give HOST:PORT, such as {DEFAULT_ADDRESS}, or 0.0.0.0:8765 for viewers on other machines"
            raise SpecError("command line", "--foxglove-listen", f"is {self.address!r}", remedy)

    @property
    def host(self) -> str:
        """The host, without the brackets of IPv6."""
        return self.address.rpartition(":")[0].strip("[]")

    @property
    def port(self) -> int:
        """The port."""
        return int(self.address.rpartition(":")[2])

    @property
    def url(self) -> str:
        """Where viewers find it."""
        return f"ws://{self.address}"

    def arguments(self) -> list[str]:
        """The options that hand this to ``touchline bridge``."""
        return ["--foxglove", "--foxglove-listen", self.address, *(["--clock"] if self.clock else [])]
