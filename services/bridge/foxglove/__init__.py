"""Server of robots for viewers that speak Foxglove's WebSocket protocol (Foxglove, Lichtblick)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from touchline.bus import Bus
from touchline.schemas.optional_packages import require
from touchline.services.bridge.foxglove.viewer_access import ViewerAccess
from touchline.services.bridge.foxglove.viewer_address import DEFAULT_ADDRESS, FoxgloveConfig

if TYPE_CHECKING:
    from touchline.services.bridge.foxglove.robot_viewers import Viewers

__all__ = ["DEFAULT_ADDRESS", "FoxgloveConfig", "ViewerAccess", "serve_viewers"]


def serve_viewers(
    buses: Sequence[Bus],
    config: FoxgloveConfig,
    access: ViewerAccess | None = None,
    stop: Callable[[], object] = lambda: False,
) -> AbstractContextManager[Viewers]:
    """Serve viewers until the context is left.

    Args:
        buses: Bus of each robot.
        config: Address and permissions.
        access: Requirements for viewers; by default those of `config` on this bus.
        stop: Waiting for an absent router ends when this returns true.

    Raises:
        TouchlineError: Foxglove's SDK is not installed, or the address cannot be listened on.
        SpecError: The address is open to the network without protection, or the options do not suit the bus.
    """
    require("foxglove", "--foxglove")
    from touchline.services.bridge.foxglove.robot_viewers import Viewers

    return Viewers.open(buses, config, access or ViewerAccess.of(config, buses[0].config), stop)
