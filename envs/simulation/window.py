"""A window on the screen, by pygame, which is an extra: nobody else needs a screen."""

import numpy as np
from numpy.typing import NDArray


class Window:
    """Shows frames at a steady rate; opens with the first one.

    Args:
        fps: no more frames a second than this are shown.

    Raises:
        ImportError: pygame is not installed; the message says how to.
    """

    def __init__(self, title: str, *, fps: float) -> None:
        try:
            import pygame
        except ImportError as error:
            raise ImportError(
                'render_mode="human" needs pygame, which is not installed; '
                'pip install "grouser[view]"'
            ) from error
        self._pygame, self._title, self._fps = pygame, title, fps
        self._clock = pygame.time.Clock()
        self._open = False

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show an RGB frame (height, width, 3), at most `fps` a second."""
        pygame = self._pygame
        height, width = frame.shape[:2]
        if not self._open:
            pygame.display.init()
            pygame.display.set_caption(self._title)
            pygame.display.set_mode((width, height))
            self._open = True
        screen = pygame.display.get_surface()
        screen.blit(pygame.surfarray.make_surface(frame.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window; a second call does nothing."""
        if self._open:
            self._pygame.display.quit()
            self._open = False
