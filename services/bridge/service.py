"""The bridge as a process."""

import gc
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from touchline.bus import Bus, BusConfig
from touchline.bus.ros2 import Ros2Session
from touchline.recordings.recorder import Existing, RecordingReport
from touchline.schemas import topics
from touchline.services.bridge.active_recording import ActiveRecording
from touchline.services.bridge.door_identity import buses_as
from touchline.services.bridge.foxglove import FoxgloveConfig, ViewerAccess, serve_viewers
from touchline.services.bridge.gateway import Gateway, GatewayConfig, passing_urgent
from touchline.services.bridge.recording_folder import RecordingFolder
from touchline.services.bridge.recording_service import BridgeService
from touchline.supervision.priority import switch_threads_soon
from touchline.supervision.shutdown import until_stopped

_OBJECTS_BETWEEN_COLLECTIONS: Final = 100_000
"""Messages make no cycles, and looking for some among thousands that wait takes a tenth of the time."""


def run_service(
    record: Path | None = None,
    config: BusConfig | None = None,
    *,
    recordings: Path | None = None,
    existing: Existing = Existing.RENAME,
    ros2: GatewayConfig | None = None,
    foxglove: FoxgloveConfig | None = None,
    supervisor: int | None = None,
) -> RecordingReport | None:
    """Run the bridge until SIGTERM or SIGINT.

    Args:
        record: File to record to from the start, in any folder.
        config: Bus configuration; from the environment if not given.
        recordings: Folder of requested recordings; by default the present one.
        existing: What to do when a recording's file exists.
        ros2: Configuration of the gateway to ROS 2, if any.
        foxglove: Configuration of the viewers' server, if any.
        supervisor: Process id of the parent, to end with it.

    Returns:
        The report of the recording that was active at the end, if any.

    Raises:
        RecordingError: ``record`` cannot be created, or there is no folder ``recordings``.
        SpecError: The bus configuration cannot be used, or ``ros2`` or ``foxglove`` do not suit it.
        TouchlineError: Another bridge is there, or the addresses of ``ros2`` or ``foxglove`` cannot be used.
    """
    config = config or BusConfig.from_environment()
    gateway_identity = ros2.checked(config) if ros2 is not None else None
    access = ViewerAccess.of(foxglove, config) if foxglove is not None else None
    folder = RecordingFolder(recordings or Path.cwd(), existing, config.identity)
    switch_threads_soon()
    with (
        until_stopped(supervisor) as stop,
        Bus.open_all(topics.BRIDGE, config, lambda: stop.asked) as buses,
        ExitStack() as stack,
    ):
        for bus in buses:
            bus.claim()
        names = [bus.namespace for bus in buses]
        gateways: list[Gateway] = []
        if ros2 is not None:
            session = stack.enter_context(Ros2Session.open(ros2.endpoint))
            asking = stack.enter_context(buses_as(gateway_identity, buses, lambda: stop.asked))
            alone = len(buses) == 1
            gateways = [
                Gateway(bus, own, session, ros2.of(bus.namespace, alone=alone), names)
                for bus, own in zip(buses, asking, strict=True)
            ]
            stack.enter_context(passing_urgent(gateways))
        viewers = None
        if foxglove is not None:
            viewers = stack.enter_context(serve_viewers(buses, foxglove, access, lambda: stop.asked))
            sys.stderr.write(f"viewers (Foxglove, Lichtblick) find {', '.join(names)} at {viewers.url_hint}\n")
        active_recording = ActiveRecording(config, folder.path, supervisor)
        service = BridgeService(buses, folder, gateways, lambda: bool(stop), active_recording, viewers)
        gc.freeze()  # a collection of all that was loaded would hold up stops from ROS 2
        gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS, 20, 50)
        if record is not None:
            service.start(record)
        else:
            service.go_on()
        return service.run(stop)
