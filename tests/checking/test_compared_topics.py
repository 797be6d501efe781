"""Every recorded topic is compared with what today's code gives, or is one of those that a check starts from."""

from touchline.checking.divergence import PART_OF
from touchline.schemas import topics

#: Time, what the robot was given, and figures of a team, which has a check of its own.
GIVEN = {
    topics.CLOCK,
    topics.REFERENCE,
    topics.ORDERS,
    topics.INITIAL_STATE,
    topics.CLAIMED,
    topics.GUIDANCE,
    topics.ALGORITHM_STATE,
    topics.ALGORITHM_WISH,
    topics.SETUP,
    topics.TEAM_SETUP,
    topics.TEAM_CELLS,
    topics.TEAM_STATUS,
    topics.TEAM_QUEUE,
    topics.TEAM_REPORT,
}


def test_every_recorded_topic_is_compared_or_given() -> None:
    recorded = {topic.name for topic in topics.TOPICS if topic.recorded}
    assert recorded == PART_OF.keys() | {topic.name for topic in GIVEN}
    assert not PART_OF.keys() & {topic.name for topic in GIVEN}
