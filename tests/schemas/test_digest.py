"""What changes a hash, and what does not."""

import random

from hypothesis import given
from hypothesis import strategies as st

from schemas import topics
from schemas.catalogue import load_template
from schemas.digest import SessionDigest, scenario_hash
from schemas.messages import PlanOptions
from schemas.scenario import GnssNoise, Scenario
from schemas.vehicle import Vehicle

SQUARE = load_template("study-square")
SAID = st.lists(st.tuples(st.sampled_from(topics.RECORDED), st.binary(max_size=40)), max_size=300)


def digest(said):
    session = SessionDigest()
    session.add(said)
    return session.hexdigest()


@given(SAID, st.randoms(use_true_random=False))
def test_how_topics_interleave_does_not_matter(said, rng: random.Random):
    queues = {topic.name: [pair for pair in said if pair[0] is topic] for topic in topics.RECORDED}
    mixed = []
    while any(queues.values()):
        mixed.append(queues[rng.choice(sorted(name for name, queue in queues.items() if queue))].pop(0))
    assert digest(mixed) == digest(said)


@given(SAID, st.data())
def test_every_byte_counts(said, data):
    other = [*said, (topics.IMU, b"")]
    assert digest(other) != digest(said)
    if said:
        index = data.draw(st.integers(0, len(said) - 1))
        topic, payload = said[index]
        assert digest([*said[:index], (topic, payload + b"x"), *said[index + 1 :]]) != digest(said)


def test_looking_in_between_changes_nothing():
    looked, plain = SessionDigest(), SessionDigest()
    for number in range(200):
        said = [(topics.IMU, bytes([number])), (topics.DIAGNOSTICS, b"wall clock")]
        looked.add(said)
        plain.add(said[:1])
        looked.hexdigest()
    assert looked.hexdigest() == plain.hexdigest()


def test_where_one_payload_ends_counts():
    assert digest([(topics.EVENTS, b"ab"), (topics.EVENTS, b"c")]) != digest(
        [(topics.EVENTS, b"a"), (topics.EVENTS, b"bc")]
    )


def cause(scenario=Scenario(), vehicle=Vehicle(), template=SQUARE, options=PlanOptions()):  # noqa: B008
    return scenario_hash(scenario, vehicle, template, options)


def test_the_scenario_hash_is_of_causes_not_of_names():
    assert cause(Scenario(name="other")) == cause()
    others = [
        cause(Scenario(seed=2)),
        cause(Scenario(noise="none")),
        cause(Scenario(noise="none", gnss=GnssNoise(white_m=0.01))),
        cause(Scenario(follower="pure-pursuit")),
        cause(vehicle=Vehicle(nozzle_y_m=-0.4)),
        cause(template=load_template("soccer-11")),
        cause(options=PlanOptions(paint_speed_mps=0.9)),
        cause(options=PlanOptions(method="dubins-padded")),
    ]
    assert len({cause(), *others}) == len(others) + 1
