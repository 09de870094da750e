"""Errors that stay the same for long, which the filter estimates beside the pose."""

from dataclasses import dataclass

import numpy as np

from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class ConstantErrors:
    """What some constant errors mean and how well they are known; a model owns its own."""

    names: tuple[str, ...]
    sigmas: Array
    """(n,) at the start, each in its own unit"""
    walks: Array
    """(n,) how far each wanders in one frame, one sigma"""

    def __len__(self) -> int:
        return len(self.names)

    def __add__(self, others: "ConstantErrors") -> "ConstantErrors":
        """These, and others after them."""
        return ConstantErrors(
            self.names + others.names,
            np.concatenate([self.sigmas, others.sigmas]),
            np.concatenate([self.walks, others.walks]),
        )


NO_ERRORS = ConstantErrors((), np.zeros(0), np.zeros(0))


def disparity_offset(sigma: float) -> ConstantErrors:
    """The one of vision: what all disparities are off by, one sigma [px]."""
    return ConstantErrors(("disparity offset [px]",), np.array([sigma]), np.array([_OFFSET_WALK]))


_OFFSET_WALK = 1e-3  # px: a rectification drifts with the temperature
