"""Part of a drive, with path and speeds, to which another part can be joined."""

from dataclasses import dataclass, replace

import numpy as np

from touchline.services.planner.segments.section import Section
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.timing import SpeedProfile


@dataclass(frozen=True)
class DrivenPart:
    """Path and speeds of a part, from arc length 0 on.

    Attributes:
        sections: Ideal curve.
        sent: Lines and arcs that approximate it.
        speeds: Speeds along what is sent.
        notes: Sentences about choices that the request left open.
    """

    sections: list[Section]
    sent: list[Sent]
    speeds: SpeedProfile
    notes: tuple[str, ...] = ()

    def then(self, other: "DrivenPart") -> "DrivenPart":
        """Append another part, which begins at this one's end pose and speed."""
        before, after = self.speeds, other.speeds
        length_m, ideal_m = self.sent[-1].end_m, self.sent[-1].ideal_to_m
        moved = [
            replace(
                each,
                start_m=each.start_m + length_m,
                end_m=each.end_m + length_m,
                ideal_from_m=each.ideal_from_m + ideal_m,
                ideal_to_m=each.ideal_to_m + ideal_m,
            )
            for each in other.sent
        ]
        speeds = SpeedProfile(
            np.concatenate((before.station_m, after.station_m[1:] + length_m)),
            np.concatenate((before.speed_mps, after.speed_mps[1:])),
            (*before.spins, *(spin._replace(station_m=spin.station_m + length_m) for spin in after.spins)),
        )
        return DrivenPart(self.sections + other.sections, self.sent + moved, speeds, self.notes + other.notes)
