"""Counts of messages missing from a recording, by topic and stretch of sim time."""

from collections.abc import Iterator
from dataclasses import dataclass, field

#: Gaps closer together than this, in sim time, belong to one episode: all topics miss something when a recorder falls
#: behind, each a little later than the other.
EPISODE_NS = 1_000_000_000
#: Most episodes of one recording; later ones are added to the last one.
MOST_EPISODES = 1000


@dataclass
class Episode:
    """Stretch of sim time in which messages are missing, with the number per topic."""

    from_ns: int
    to_ns: int
    lost: dict[str, int] = field(default_factory=dict)

    def metadata(self) -> dict[str, str]:
        """Return it as metadata of the recording."""
        counts = {name: str(count) for name, count in self.lost.items()}
        return {"from_s": f"{self.from_ns / 1e9:.3f}", "to_s": f"{self.to_ns / 1e9:.3f}", **counts}


class Losses:
    """Accumulator of missing messages.

    Attributes:
        total: Messages of all topics.
        episodes: Stretches in which they are missing, in order of arrival.
    """

    def __init__(self) -> None:
        """Start with nothing missing."""
        self.total = 0
        self.episodes: list[Episode] = []

    def add(self, name: str, count: int, before_ns: int, after_ns: int) -> None:
        """Add `count` missing messages of topic `name` between two that were sent at these sim times.

        Args:
            name: Name in the topic table.
            count: Number of missing messages.
            before_ns: Sim time of the message before them.
            after_ns: Sim time of the message after them.
        """
        self.total += count
        first_ns, last_ns = sorted((before_ns, after_ns))
        last = self.episodes[-1] if self.episodes else None
        apart = last is None or not last.from_ns - EPISODE_NS <= first_ns <= last.to_ns + EPISODE_NS
        if last is None or (apart and len(self.episodes) < MOST_EPISODES):
            last = Episode(first_ns, last_ns)
            self.episodes.append(last)
        last.from_ns, last.to_ns = min(last.from_ns, first_ns), max(last.to_ns, last_ns)
        last.lost[name] = last.lost.get(name, 0) + count

    def metadata(self) -> Iterator[tuple[str, dict[str, str]]]:
        """Yield the recording's metadata records: the total, then episode by episode."""
        per_topic: dict[str, int] = {}
        for episode in self.episodes:
            for name, count in episode.lost.items():
                per_topic[name] = per_topic.get(name, 0) + count
        yield "touchline_lost", {"total": str(self.total), **{name: str(n) for name, n in sorted(per_topic.items())}}
        for number, episode in enumerate(self.episodes, 1):
            yield f"touchline_lost_{number}", episode.metadata()
