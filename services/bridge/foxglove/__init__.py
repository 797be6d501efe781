"""Robots for viewers that speak Foxglove's WebSocket protocol (Foxglove, Lichtblick): topics, orders, parameters."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from touchline.bus import Bus
from touchline.schemas.optional_packages import require
from touchline.services.bridge.foxglove.viewer_address import DEFAULT_ADDRESS, FoxgloveConfig

if TYPE_CHECKING:
    from touchline.services.bridge.foxglove.robot_viewers import Viewers

__all__ = ["DEFAULT_ADDRESS", "FoxgloveConfig", "serve_viewers"]


def serve_viewers(buses: Sequence[Bus], config: FoxgloveConfig) -> AbstractContextManager[Viewers]:
    """Serve viewers until the context is left.

    Args:
        buses: Of each robot.
        config: Where they are served.

    Raises:
        TouchlineError: Foxglove's SDK is not installed, or the address cannot be listened on.
    """
    require("foxglove", "--foxglove")
    from touchline.services.bridge.foxglove.robot_viewers import Viewers

    return Viewers.open(buses, config)
