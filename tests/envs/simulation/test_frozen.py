"""A world stays as it was made, wherever it is sent."""

import copy
import pickle
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.envs.simulation.worlds.registry import make_world

WORLD = make_world("forest", np.random.default_rng(0))


def arrays(value: object) -> Iterator[NDArray[Any]]:
    if isinstance(value, np.ndarray):
        yield value
    elif is_dataclass(value):
        for f in fields(value):
            yield from arrays(getattr(value, f.name))


@pytest.mark.parametrize(
    "send", [lambda w: w, copy.copy, copy.deepcopy, lambda w: pickle.loads(pickle.dumps(w))]
)
def test_nobody_writes_to_a_world(send: Any) -> None:
    sent = list(arrays(send(WORLD)))
    assert len(sent) > 15
    assert not any(array.flags.writeable for array in sent)
    assert all(np.array_equal(a, b) for a, b in zip(sent, arrays(WORLD), strict=True))
