"""Ways in which what a robot senses goes wrong, as edits of observations: for whoever tests.

A spoil takes an observation, and those before it, to what a broken sensor would have told.
"""

from collections.abc import Callable, Sequence
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import Observation

Spoil = Callable[[Sequence[Observation], int, int, np.random.Generator], dict[str, NDArray[Any]]]
"""Keys that differ in a frame, given all frames, the first spoilt one, the frame, and chance."""

_EYES = ("left", "right")


def _of_images(
    edit: Callable[[NDArray[np.uint8], np.random.Generator], NDArray[Any]],
    eyes: Sequence[str] = _EYES,
) -> Spoil:
    """Each eye's image by itself."""

    def spoil(
        frames: Sequence[Observation], start: int, frame: int, rng: np.random.Generator
    ) -> dict[str, NDArray[Any]]:
        shown = {eye: edit(frames[frame][eye], rng) for eye in eyes}
        return {
            eye: np.clip(np.rint(image), 0, 255).astype(np.uint8) for eye, image in shown.items()
        }

    return spoil


def _of_tracks(edit: Callable[[Sequence[Observation], int, int], Any]) -> Spoil:
    def spoil(
        frames: Sequence[Observation], start: int, frame: int, rng: np.random.Generator
    ) -> dict[str, NDArray[Any]]:
        return {"tracks": np.asarray(edit(frames, start, frame), dtype=np.float64)}

    return spoil


def _blurred(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[Any]:
    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 10.0).reshape(image.shape)
    return np.asarray(smooth + rng.normal(0, 1.5, image.shape))


def _frozen(noise: float) -> Spoil:
    """The last good pair again and again; a grabber repeats bits, a stuck scene has new noise."""

    def spoil(
        frames: Sequence[Observation], start: int, frame: int, rng: np.random.Generator
    ) -> dict[str, NDArray[Any]]:
        last = {eye: frames[start - 1][eye] for eye in _EYES}
        if noise == 0:
            return {eye: image.copy() for eye, image in last.items()}
        noisy = {eye: image + rng.normal(0, noise, image.shape) for eye, image in last.items()}
        return {eye: np.clip(np.rint(i), 0, 255).astype(np.uint8) for eye, i in noisy.items()}

    return spoil


def _swapped(
    frames: Sequence[Observation], start: int, frame: int, rng: np.random.Generator
) -> dict[str, NDArray[Any]]:
    return {"left": frames[frame]["right"].copy(), "right": frames[frame]["left"].copy()}


def _one_eye_twice(
    frames: Sequence[Observation], start: int, frame: int, rng: np.random.Generator
) -> dict[str, NDArray[Any]]:
    """No parallax: nothing has a depth."""
    return {"right": frames[frame]["left"].copy()}


def _together(*spoils: Spoil) -> Spoil:
    def spoil(
        frames: Sequence[Observation], start: int, frame: int, rng: np.random.Generator
    ) -> dict[str, NDArray[Any]]:
        edited: dict[str, NDArray[Any]] = {}
        for one in spoils:
            edited |= one(frames, start, frame, rng)
        return edited

    return spoil


_BLACK = _of_images(lambda image, rng: np.zeros_like(image))
_NAN = _of_tracks(lambda frames, start, frame: np.full(2, np.nan))

SPOILS = MappingProxyType(
    {
        "black": _BLACK,
        "dark": _of_images(lambda image, rng: 0.02 * image + rng.normal(0, 1.5, image.shape)),
        "white": _of_images(lambda image, rng: np.full_like(image, 255)),
        "saturated": _of_images(lambda image, rng: 5.0 * image),
        "blurred": _of_images(_blurred),
        "static": _of_images(lambda image, rng: rng.uniform(0, 255, image.shape)),
        "right eye black": _of_images(lambda image, rng: np.zeros_like(image), eyes=("right",)),
        "one eye twice": _one_eye_twice,
        "frozen": _frozen(0.0),
        "frozen, noisy": _frozen(1.5),
        "swapped": _swapped,
        "tracks silent": _NAN,
        "tracks zero": _of_tracks(lambda frames, start, frame: np.zeros(2)),
        "tracks stuck": _of_tracks(lambda frames, start, frame: frames[start - 1]["tracks"]),
        "left track zero": _of_tracks(
            lambda frames, start, frame: [0.0, frames[frame]["tracks"][1]]
        ),
        "black, tracks silent": _together(_BLACK, _NAN),
        "frozen, tracks silent": _together(_frozen(0.0), _NAN),
    }
)
"""By name."""


def spoilt(
    frames: Sequence[Observation], name: str, window: range, rng: np.random.Generator
) -> list[Observation]:
    """The frames with those of a window, which does not begin with the first, spoilt.

    Raises:
        KeyError: no spoil has that name.
    """
    spoil = SPOILS[name]
    return [
        {**shown, **spoil(frames, window.start, index, rng)} if index in window else shown
        for index, shown in enumerate(frames)
    ]
