"""Full times of a receiver's messages, which themselves have a time of day or of the week only."""

from __future__ import annotations

import math
from datetime import UTC, date, datetime

DAY_S = 86400.0


class ReceiverClock:
    """Converter to seconds since 1970 (UTC) of messages in order of arrival.

    NMEA has the time of day, and in some sentences the date; days pass at midnight. UBX has the time of the week, which
    no leap second and no midnight disturbs, and in some messages the date. Before a first date the days are counted
    from 1970; `shift_s` is the error of those times.
    """

    def __init__(self) -> None:
        self._latest_s: float | None = None
        self._dated = False
        self._of_week_s: float | None = None
        self.shift_s = 0.0

    @property
    def is_dated(self) -> bool:
        """True if a date has been received."""
        return self._dated

    def of_day(self, second_s: float) -> float:
        """Convert a time of day [s]: within half a day of the time before."""
        latest_s = self._latest_s
        if latest_s is None:
            self._latest_s = second_s
            return second_s
        time_s = second_s + DAY_S * round((latest_s - second_s) / DAY_S)
        self._latest_s = time_s
        return time_s

    def dated(self, day: date, second_s: float) -> float:
        """Convert a date and a time of day [s]."""
        midnight = datetime(day.year, day.month, day.day, tzinfo=UTC)
        time_s = midnight.timestamp() + second_s
        if not self._dated:
            self._dated = True
            if self._latest_s is not None:
                before_s = second_s + DAY_S * round((self._latest_s - second_s) / DAY_S)
                self.shift_s = time_s - before_s
        self._latest_s = time_s
        return time_s

    def of_week(self, second_s: float, utc_s: float | None = None) -> float:
        """Convert a time of the week [s]; NaN before the first date.

        Args:
            second_s: GPS time of the week.
            utc_s: The same in UTC, if the message has it; the first one gives week and leap seconds.
        """
        if utc_s is not None:
            self._dated, self._latest_s = True, utc_s
            exact_s = utc_s - second_s
            if self._of_week_s is None or abs(exact_s - self._of_week_s) > 2.0:
                self._of_week_s = round(exact_s * 1e3) / 1e3
        if self._of_week_s is None:
            return math.nan
        return self._of_week_s + second_s
