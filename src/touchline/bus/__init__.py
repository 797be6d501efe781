"""The bus: typed topics and services over Eclipse Zenoh. The only package that imports zenoh."""

from touchline.bus.bus import Bus
from touchline.bus.calls import AccessError, Answer, CallError, ServedCall, Server
from touchline.bus.config import BusConfig
from touchline.bus.health import HealthReporter
from touchline.bus.inbox import Inbox, Sample
from touchline.bus.publisher import Publisher
from touchline.bus.stop_proof import StopProof
from touchline.bus.urgent_order import UrgentOrder, repeat_at_door, repeat_until_acknowledged

__all__ = [
    "AccessError",
    "Answer",
    "Bus",
    "BusConfig",
    "CallError",
    "HealthReporter",
    "Inbox",
    "Publisher",
    "Sample",
    "ServedCall",
    "Server",
    "StopProof",
    "UrgentOrder",
    "repeat_at_door",
    "repeat_until_acknowledged",
]
