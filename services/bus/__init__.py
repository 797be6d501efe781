"""The bus: typed topics and services over Eclipse Zenoh. The only package that imports zenoh."""

from touchline.services.bus.bus import Bus
from touchline.services.bus.calls import Answer, CallError, ServedCall, Server
from touchline.services.bus.config import BusConfig
from touchline.services.bus.health import HealthReporter
from touchline.services.bus.inbox import Inbox, Sample
from touchline.services.bus.insist import UrgentOrder, insist
from touchline.services.bus.publisher import Publisher
from touchline.services.bus.stop_proof import StopProof, proves

__all__ = [
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
    "insist",
    "proves",
]
