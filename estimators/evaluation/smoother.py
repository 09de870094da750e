"""What an estimator is besides that corrects earlier poses by what it learns later."""

from abc import ABC, abstractmethod

from grouser.geometry import Array


class Smoother(ABC):
    """Knows the whole way, better than it was known when it was driven."""

    @property
    @abstractmethod
    def trajectory(self) -> Array:
        """(n, 3) the pose of each observation since `reset`, in the frame of the first, as it is
        known now.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
