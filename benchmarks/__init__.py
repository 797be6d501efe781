"""Figures that depend on the machine; run all with ``make bench`` or some with ``python -m benchmarks NAME…``."""
