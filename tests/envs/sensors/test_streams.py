"""Random numbers by name: what one stage draws changes no other's."""

import pickle

import numpy as np
import pytest
from scipy.stats import kstest

from grouser.envs.sensors.streams import Streams
from grouser.envs.sensors.wandering import Wandering


def test_a_stream_does_not_depend_on_which_others_are_used() -> None:
    one, other = (Streams(np.random.default_rng(3)) for _ in range(2))
    one["dropout"].random(5)
    assert one["mixed"].random() == other["mixed"].random()
    assert one["dropout"].random() != other["mixed"].random()


def test_the_generator_of_which_they_come_is_left_as_it_is() -> None:
    rng, same = np.random.default_rng(3), np.random.default_rng(3)
    Streams(rng)["dropout"].random(5)
    assert rng.random() == same.random()
    assert rng.spawn(1)[0].random() == same.spawn(1)[0].random()


def test_streams_of_other_seeds_differ() -> None:
    children = np.random.default_rng(0).spawn(3)
    drawn = {float(Streams(rng)["dropout"].random()) for rng in children}
    assert len(drawn) == 3


def test_streams_go_on_after_pickling_to_the_bit() -> None:
    streams = Streams(np.random.default_rng(3))
    streams["dropout"].random(5)
    again = pickle.loads(pickle.dumps(streams))
    for name in ("dropout", "new"):
        assert again[name].random() == streams[name].random()


def test_what_wanders_has_unit_variance_and_forgets_in_its_time() -> None:
    wandering = Wandering(4000, correlation_time=10.0, rng=np.random.default_rng(0))
    first = wandering.after(0.0)
    for _ in range(50):
        later = wandering.after(0.2)
    assert kstest(later, "norm").pvalue > 1e-3
    assert np.corrcoef(first, later)[0, 1] == pytest.approx(np.exp(-1), abs=0.05)
