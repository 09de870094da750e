"""Random numbers for every stage of a sensor: what one stage draws changes no other's."""

from zlib import crc32

import numpy as np


class Streams:
    """Independent generators by name, all of one seed; the same whichever are used, and when.

    Args:
        rng: a fresh generator, whose seed this takes and which it leaves as it is.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        seed = rng.bit_generator.seed_seq
        assert isinstance(seed, np.random.SeedSequence)
        self._seed = seed
        self._made: dict[str, np.random.Generator] = {}

    def __getitem__(self, name: str) -> np.random.Generator:
        if name not in self._made:
            own = (*self._seed.spawn_key, crc32(name.encode()))
            child = np.random.SeedSequence(self._seed.entropy, spawn_key=own)
            self._made[name] = np.random.Generator(np.random.PCG64(child))
        return self._made[name]
