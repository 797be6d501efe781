"""The bus: typed topics and services over Eclipse Zenoh. The only package that imports zenoh."""

from services.bus.bus import Bus
from services.bus.calls import CallError, ServedCall, Server
from services.bus.config import BusConfig
from services.bus.health import HealthReporter
from services.bus.inbox import Inbox, Sample
from services.bus.insist import insist
from services.bus.publisher import Publisher

__all__ = [
    "Bus",
    "BusConfig",
    "CallError",
    "HealthReporter",
    "Inbox",
    "Publisher",
    "Sample",
    "ServedCall",
    "Server",
    "insist",
]
