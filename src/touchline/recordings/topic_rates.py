"""Rates of topics, and their jitter."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from touchline.recordings.recorded import Recorded


@dataclass(frozen=True)
class TopicRate:
    """Rate of one topic.

    Attributes:
        messages: Number of messages.
        rate_hz: Mean from the first to the last; None for fewer than two, or all at once.
        gap_p50_ms, gap_p95_ms, gap_max_ms: Time from one message to the next: median, 95th percentile, longest.
        jitter_ms: Standard deviation of that.
    """

    messages: int
    rate_hz: float | None = None
    gap_p50_ms: float | None = None
    gap_p95_ms: float | None = None
    gap_max_ms: float | None = None
    jitter_ms: float | None = None


def topic_rates(messages: Iterable[Recorded]) -> dict[str, TopicRate]:
    """Return the rate of each topic, by log times, sorted by name."""
    times: dict[str, list[int]] = {}
    for message in messages:
        times.setdefault(message.topic, []).append(message.log_time_ns)
    return {name: _rate(np.array(found, dtype=np.int64)) for name, found in sorted(times.items())}


def _rate(times_ns: np.ndarray[tuple[int], np.dtype[np.int64]]) -> TopicRate:
    if len(times_ns) < 2:
        return TopicRate(len(times_ns))
    gaps_ms = np.diff(times_ns) / 1e6
    span_s = float(times_ns[-1] - times_ns[0]) / 1e9
    p50, p95 = (float(value) for value in np.percentile(gaps_ms, (50, 95)))
    rate_hz = (len(times_ns) - 1) / span_s if span_s > 0 else None
    return TopicRate(len(times_ns), rate_hz, p50, p95, float(gaps_ms.max()), float(gaps_ms.std()))
