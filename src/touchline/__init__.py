"""Touchline: plans, drives and records the work of ground robots.

Public are the names in `__all__`, which are imported when they are first used, and those of `touchline.plugins`; all
else may change in any version. In a checkout `schemas`, `services`, `tui` and `research` are
folders at its top (see `setup.py`); installed they lie beside this file.
"""

import os

if os.name != "posix":
    raise ImportError("Touchline needs Linux (or macOS, untested): locks and signals of POSIX; on Windows, use WSL")

import touchline.shipped_plugins  # noqa: F401 - which fills the registries
from touchline.lazy_names import lazy_names
from touchline.schemas.optional_packages import name_packages_of_missing_imports

name_packages_of_missing_imports()

_API = "touchline.api"
#: Modules of the public names; `__init__.pyi` has them for type checkers.
_PUBLIC = {
    "AsyncRobot": f"{_API}.live_robot",
    "CallError": "touchline.bus.calls",
    "Check": f"{_API}.checks",
    "CommandRefused": "touchline.schemas.errors",
    "Emulator": f"{_API}.step_emulator",
    "FleetRun": f"{_API}.teams",
    "FollowerAhead": f"{_API}.function_follower",
    "FollowerState": f"{_API}.function_follower",
    "GoalRun": f"{_API}.goal_drive",
    "MissingExtra": "touchline.schemas.errors",
    "OnboardConfig": "touchline.schemas.onboard",
    "Plan": f"{_API}.planned",
    "PlanOptions": f"{_API}.plan_options",
    "PlanningError": "touchline.schemas.errors",
    "Recording": f"{_API}.recording",
    "RecordingError": "touchline.recordings.recording_file",
    "Robot": f"{_API}.live_robot",
    "RobotUnavailable": f"{_API}.live_robot",
    "Run": f"{_API}.simulated",
    "Scenario": "touchline.schemas.scenario",
    "Series": f"{_API}.recording",
    "SpecError": "touchline.schemas.errors",
    "Table": f"{_API}.sweeps",
    "Template": "touchline.schemas.template",
    "TouchlineError": "touchline.schemas.errors",
    "Vehicle": "touchline.schemas.vehicles",
    "__version__": f"{_API}.version",
    "check": f"{_API}.checks",
    "connect": f"{_API}.live_robot",
    "connect_async": f"{_API}.live_robot",
    "fleet": f"{_API}.teams",
    "followers": f"{_API}.given_arguments",
    "goto": f"{_API}.goal_drive",
    "load_template": f"{_API}.given_arguments",
    "load_vehicle": "touchline.schemas.catalogue",
    "plan": f"{_API}.planned",
    "simulate": f"{_API}.simulated",
    "sweep": f"{_API}.sweeps",
    "templates": f"{_API}.given_arguments",
    "vehicles": f"{_API}.given_arguments",
}
__all__ = sorted(_PUBLIC)  # noqa: PLE0605 - of the table
__getattr__, __dir__ = lazy_names(__name__, _PUBLIC)
