"""Where estimators get randomness from: the seed of an episode, apart from its environment."""

import zlib

import numpy as np

# The environment spawns its streams from the bare seed; this keeps those of estimators apart.
_STREAM = zlib.crc32(b"grouser.estimators")


def estimator_seeds(seed: int | None) -> np.random.SeedSequence:
    """Seeds for estimators, one child an episode, from the seed of the first (or from the system).

    It depends on the seed alone, so that neither an estimator's name nor who else takes part in a
    comparison changes a result.
    """
    return np.random.SeedSequence(seed, spawn_key=(_STREAM,))


def estimator_rng(seed: int) -> np.random.Generator:
    """The generator of the first episode after `reset(seed=seed)`."""
    (child,) = estimator_seeds(seed).spawn(1)
    return np.random.default_rng(child)
