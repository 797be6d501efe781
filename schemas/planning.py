"""What a request for a plan may ask for by name."""

from typing import Final, Literal

Method = Literal["g2", "ccd", "dubins-padded"]
"""How painted lines are joined: `g2` continuous in curvature, each turn as tight as the wheels allow at its speed;
`ccd` continuous in curvature, with one largest curvature and one sharpness; `dubins-padded` by plain arcs, the study's
baseline."""
DEFAULT_METHOD: Final[Method] = "g2"
