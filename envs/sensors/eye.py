"""One eye: light falls through the lens onto the sensor, which adds its noise and tells frames."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from grouser.envs.sensors.lens import Lens, Picture, defocused
from grouser.envs.sensors.read_noise import add_read_noise
from grouser.envs.sensors.streams import Streams
from grouser.envs.sensors.wandering import Wandering
from grouser.geometry import Array

Image = NDArray[np.uint8]

_EXPOSURE_TIME = 10.0
"""Correlation time of the exposure, s."""


@dataclass(frozen=True, slots=True)
class EyeEffects:
    """The amounts of one eye's effects, as EFFECTS names them."""

    read_noise: float
    shot_noise: float
    exposure_drift: float
    motion_blur: float
    vignetting: float
    defocus: float
    rolling_shutter: float
    distortion: float
    rectification_error: float
    dropped: float
    frozen: float
    darkness: float
    glare: float

    @staticmethod
    def of(eye: str, amounts: Mapping[str, float]) -> "EyeEffects":
        """Those of an eye among the amounts of all effects."""
        return EyeEffects(**{f.name: amounts[f"{eye}.{f.name}"] for f in fields(EyeEffects)})

    @property
    def changes_light(self) -> bool:
        """Whether there is more to do than to add read noise and to tell frames."""
        return any(
            (
                self.shot_noise,
                self.exposure_drift,
                self.vignetting,
                self.defocus,
                self.distortion,
                self.rectification_error,
                self.darkness,
                self.glare,
            )
        )


@dataclass(slots=True)
class EyeMemory:
    """What changes in an eye."""

    rng: np.random.Generator
    """Of the read noise."""
    own: Streams
    """Of what is this eye's alone."""
    of_pair: Streams
    """Of what hits both eyes at once: each has these of the same seed."""
    exposure: Wandering | None = None
    last: Image | None = None
    """The frame before, off the sensor."""


@dataclass(frozen=True, slots=True)
class Scene:
    """What an eye must know of what it looks at."""

    brightness: float
    """Of the light that there is, over that at the start."""
    sun: Array | None
    """(3,) unit vector towards the sun, optical frame; None where it is not to be seen."""
    elapsed: float
    """Since the last frame, s."""


class Eye:
    """Turns light into an image; the memory is its owner's."""

    def __init__(self, lens: Lens) -> None:
        self._lens = lens

    def image(
        self, light: Image | Picture, scene: Scene, gain: float, effects: EyeEffects, m: EyeMemory
    ) -> Image:
        """The rectified image of light (height, width, channels) [grey levels].

        Args:
            gain: everything is this much brighter.
        """
        if effects.changes_light or scene.brightness != 1 or gain != 1:
            true_k1 = effects.distortion + effects.rectification_error
            picture = self._lens.distorted(light.astype(np.float32), true_k1)
            picture = defocused(picture, effects.defocus)
            picture = self._exposed(picture, scene, gain, effects, m)
            light = _with_shot_noise(picture, effects.shot_noise, m.own)
        frame = add_read_noise(_eight_bits(light), effects.read_noise, m.rng)
        frame = _told(frame, effects, m)
        return self._lens.rectified(frame, effects.distortion)

    def _exposed(
        self, picture: Picture, scene: Scene, gain: float, effects: EyeEffects, m: EyeMemory
    ) -> Picture:
        """The light that is left after darkness and vignetting, under the sun's veil."""
        gain *= scene.brightness * (1 - effects.darkness)
        if effects.exposure_drift:
            if m.exposure is None:
                rng = m.of_pair["exposure_drift"]
                m.exposure = Wandering(1, correlation_time=_EXPOSURE_TIME, rng=rng)
            gain *= float(np.exp(effects.exposure_drift * m.exposure.after(scene.elapsed)[0]))
        exposed = np.float32(gain) * picture
        if effects.vignetting:
            exposed *= self._lens.vignette(effects.vignetting)
        if effects.glare and scene.sun is not None:
            veil = self._lens.glare(effects.glare, scene.sun)
            exposed += veil * (255 - exposed)
        return exposed


def _with_shot_noise(picture: Picture, gain: float, streams: Streams) -> Picture:
    """Photons come by chance: the variance is the level times the camera's gain.

    (EMVA Standard 1288, release 4.0, eq. (7): sigma^2 = K * mean, beside the dark noise.)
    """
    if gain == 0:
        return picture
    noise = streams["shot_noise"].standard_normal(picture.shape, dtype=np.float32)
    return np.asarray(picture + np.sqrt(gain * np.maximum(picture, 0)) * noise)


def _eight_bits(light: Image | Picture) -> Image:
    if light.dtype == np.uint8:
        return np.asarray(light, dtype=np.uint8)
    return np.asarray(np.clip(light + np.float32(0.5), 0, 255), dtype=np.uint8)


def _told(frame: Image, effects: EyeEffects, m: EyeMemory) -> Image:
    """The frame as it gets out of the camera: the one before once more, or black, by chance."""
    if effects.frozen and m.of_pair["frozen"].random() < effects.frozen and m.last is not None:
        frame = m.last.copy()
    m.last = frame.copy()
    if effects.dropped and m.of_pair["dropped"].random() < effects.dropped:
        frame = np.zeros_like(frame)
    return frame
