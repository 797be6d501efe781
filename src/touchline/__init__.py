"""Touchline: plans, drives and records the work of ground robots.

In a checkout `schemas`, `services`, `tui` and `research` are folders at its top (see `setup.py`); installed they lie
beside this file.
"""

import os

if os.name != "posix":
    raise ImportError("Touchline needs Linux (or macOS, untested): locks and signals of POSIX; on Windows, use WSL")

import touchline.shipped_plugins  # noqa: F401 - which fills the registries
