"""When a sensor measures, and when what it measured is seen: rates and latencies."""

import math
import pickle
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.effects import known
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World

TIMED = ("stereo", "left", "right", "tracks", "lidar", "imu", "gps")
"""What may have a rate and a latency of its own; left and right follow stereo."""

LONGEST_STAMP = 1e9
"""s, thirty years: a bound only because spaces must have one."""

_NAMES = tuple(f"{sensor}.{what}" for sensor in TIMED for what in ("rate", "latency"))
_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class Timing:
    """A sensor measures every `period` control steps and is seen `delay` steps later."""

    period: int = 1
    delay: int = 0


def timing_of(key: str, timing: Mapping[str, float], dt: float) -> Timing:
    """The timing of a key of the observation, in control steps of dt [s].

    Args:
        timing: rates [Hz] and latencies [s] by name, such as {"lidar.rate": 5.0,
            "stereo.latency": 0.1}; without them a sensor measures at every step and is seen at
            once.

    Raises:
        ValueError: an unknown name, a rate whose period is no whole multiple of the control step
            (the message has the nearest that is), or a negative latency.
    """
    if not isinstance(timing, Mapping):
        raise ValueError(
            f"timing must be numbers by name, such as {{'lidar.rate': 5.0}}, got {timing!r}"
        )
    for name in timing:
        known(name, _NAMES, "timing")
    both = "stereo" if key in ("left", "right") else key
    rate, rate_name = _given(timing, "rate", key, both)
    latency, latency_name = _given(timing, "latency", key, both)
    return Timing(
        1 if rate is None else _period(rate, dt, rate_name),
        0 if latency is None else _delay(latency, dt, latency_name),
    )


def _given(timing: Mapping[str, float], what: str, *sensors: str) -> tuple[float | None, str]:
    """What the first of these sensors that has one is given, and its name."""
    for sensor in sensors:
        name = f"{sensor}.{what}"
        if name in timing:
            return timing[name], name
    return None, ""


def _period(rate: float, dt: float, name: str) -> int:
    if not (isinstance(rate, Real) and 0 < rate < math.inf):
        raise ValueError(f"{name} must be a positive number of Hz, got {rate!r}")
    steps = 1 / (rate * dt)
    nearest = max(round(steps), 1)
    if abs(steps - nearest) > _ROUNDING * nearest:
        raise ValueError(
            f"{name} of {rate:g} Hz is every {1 / rate:g} s, which is no whole multiple of the "
            f"control step of {dt:g} s; the nearest that is: {1 / (nearest * dt):g} Hz"
        )
    return nearest


def _delay(latency: float, dt: float, name: str) -> int:
    if not (isinstance(latency, Real) and 0 <= latency < math.inf):
        raise ValueError(f"{name} must be 0 s or more, got {latency!r}")
    return math.ceil(latency / dt - _ROUNDING)


@dataclass(slots=True)
class _Sent:
    """A reading on its way."""

    seen_from: int
    stamp: float
    reading: Reading


@dataclass(slots=True)
class _Memory:
    step: int = -1
    queue: deque[_Sent] = field(default_factory=deque)


class Delivered(Sensor):
    """A sensor whose readings come at a rate and with a latency of their own.

    `read` is called at every control step: it shows what came last (zeros where that adds up and
    was shown before), and beside each key `<key>_stamp` (1,): when that was measured, s since the
    start. What is measured at the start is seen at once.

    Args:
        sensor: what measures.
        timing: how often, and how much later it is seen.
        dt: length of a control step, s.
    """

    _memory: _Memory

    def __init__(self, sensor: Sensor, timing: Timing, *, dt: float) -> None:
        self._sensor, self._timing, self._dt = sensor, timing, dt

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        inner = self._sensor.spaces
        stamp = spaces.Box(0.0, LONGEST_STAMP, (1,), np.float64)
        return inner | {f"{key}_stamp": stamp for key in inner}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._sensor.enter(world, rngs)
        self._memory = _Memory()

    def advance(self, motion: Motion) -> None:
        self._sensor.advance(motion)

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        memory = self._memory
        memory.step += 1
        if memory.step % self._timing.period == 0:
            self._send(self._sensor.read(motion, amounts))
        new = self._receive()
        shown = memory.queue[0]
        old = self._sensor.adds_up and not new
        values = {k: np.zeros_like(v) if old else v.copy() for k, v in shown.reading.items()}
        return values | {f"{key}_stamp": np.array([shown.stamp]) for key in values}

    def save(self) -> bytes:
        return pickle.dumps((self._memory, self._sensor.save()))

    def restore(self, saved: bytes) -> None:
        self._memory, inner = pickle.loads(saved)
        self._sensor.restore(inner)

    def close(self) -> None:
        self._sensor.close()

    def _send(self, reading: Reading) -> None:
        step = self._memory.step
        delay = self._timing.delay if step > 0 else 0
        self._memory.queue.append(_Sent(step + delay, step * self._dt, reading))

    def _receive(self) -> bool:
        """Let the head of the queue be what came last; whether it came just now."""
        memory = self._memory
        queue = memory.queue
        while len(queue) > 1 and queue[1].seen_from <= memory.step:
            queue.popleft()
        return queue[0].seen_from == memory.step
