"""Units of message fields: from the suffix of our names, by REP-103 for ROS 2's standard messages."""

import re

_SUFFIXES = {
    "mps": "m/s",
    "mps2": "m/s²",
    "radps": "rad/s",
    "radps2": "rad/s²",
    "1pm": "1/m",
    "1pm2": "1/m²",
    "m": "m",
    "m2": "m²",
    "mm": "mm",
    "s": "s",
    "l": "l",
    "lps": "l/s",
    "rad": "rad",
    "deg": "deg",
    "hz": "Hz",
    "pct": "%",
    "wh": "Wh",
}
_STANDARD = (
    (r"(^|\.)(stamp|clock)(\.sec)?$", "s"),
    (r"\.nanosec$", "ns"),
    (r"angular_velocity\.[xyz]$|twist\.angular\.[xyz]$", "rad/s"),
    (r"linear_acceleration\.[xyz]$", "m/s²"),
    (r"twist\.linear\.[xyz]$", "m/s"),
    (r"(position|translation|points)\.[xyz]$|altitude$", "m"),
    (r"(latitude|longitude)$", "deg"),
    (r"magnetic_field\.[xyz]$", "T"),
    (r"voltage$", "V"),
    (r"current$", "A"),
    (r"(^|\.)(charge|capacity)$", "Ah"),
)


def unit_of(field: str) -> str:
    """Return the unit of the field at this path, such as ``pose.position.x`` or ``x_m[3]``; empty if it has none."""
    path = re.sub(r"\[\d*\]", "", field)
    suffix = _SUFFIXES.get(path.rsplit("_", 1)[-1]) if "_" in path.rsplit(".", 1)[-1] else None
    return suffix or next((unit for pattern, unit in _STANDARD if re.search(pattern, path)), "")
