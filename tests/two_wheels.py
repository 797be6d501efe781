"""Commands of a drive with two actuators."""

from touchline.onboard.interface import standstill

STANDSTILL = standstill(2)
