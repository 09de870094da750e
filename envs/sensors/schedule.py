"""When what is wrong: effects that hold all the time, and faults that hold for a while."""

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from math import inf
from numbers import Real
from types import MappingProxyType
from typing import Any

from grouser.envs.sensors.effects import EFFECTS, checked_amount

_ROUNDING = 1e-9
"""The time of the k-th step, k * dt, may be rounded to before a change that it should see, s."""


@dataclass(frozen=True, slots=True)
class Fault:
    """An effect has an amount from a start to an end.

    Raises:
        ValueError: an unknown effect, an amount that it may not have, or times that are no span.
    """

    what: str
    """One of EFFECTS."""
    start: float = 0.0
    """s since reset."""
    end: float = inf
    """s since reset; at this time it is over."""
    amount: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "amount", checked_amount(self.what, self.amount))
        for name in ("start", "end"):
            value = getattr(self, name)
            if not (isinstance(value, Real) and float(value) >= 0):
                raise ValueError(
                    f"the {name} of a fault of {self.what} must be 0 s or more, got {value!r}"
                )
        if not self.start < self.end:
            raise ValueError(
                f"a fault of {self.what} must end after it starts, at {self.start:g} s, "
                f"got end {self.end:g} s"
            )

    @staticmethod
    def of(description: "Mapping[str, Any] | Fault") -> "Fault":
        """A fault from {"what": ..., "start": ..., "end": ..., "amount": ...}, as JSON has it.

        Only `what` is needed: without a start it holds from the beginning, without an end for
        ever, without an amount it is 1.

        Raises:
            ValueError: as above, or other entries than these.
        """
        if isinstance(description, Fault):
            return description
        names = [f.name for f in fields(Fault)]
        if not isinstance(description, Mapping) or "what" not in description:
            raise ValueError(f"a fault needs 'what', the name of an effect, got {description!r}")
        unknown = [name for name in description if name not in names]
        if unknown:
            raise ValueError(f"a fault has no {unknown[0]!r}; it has: {', '.join(names)}")
        return Fault(**{name: value for name, value in description.items() if value is not None})


class Schedule:
    """Every effect's amount at every time.

    Args:
        effects: amounts that hold all the time, by name in EFFECTS; the others have their default.
        faults: what holds for a while instead; where several of one effect do, the last of them.

    Raises:
        ValueError: an unknown effect, an amount that it may not have, or a malformed fault.
    """

    def __init__(
        self,
        effects: Mapping[str, float] | None = None,
        faults: Sequence[Mapping[str, Any] | Fault] = (),
    ) -> None:
        effects = {} if effects is None else effects
        _require_containers(effects, faults)
        self._effects = {name: checked_amount(name, a) for name, a in effects.items()}
        self.faults = tuple(Fault.of(fault) for fault in faults)
        """In the order in which they were given."""
        ends = {time for fault in self.faults for time in (fault.start, fault.end)}
        self._changes = [-inf, *sorted(ends - {inf}), inf]
        self._spans: dict[int, Mapping[str, float]] = {}
        self._from, self._until = inf, -inf
        self._current: Mapping[str, float] = {}

    @property
    def steady(self) -> Mapping[str, float]:
        """Every effect's amount where no fault holds."""
        return _amounts(self._effects)

    def at(self, time: float) -> Mapping[str, float]:
        """Every effect's amount [its unit] at a time, s since reset; left.* and right.* too."""
        time = time + _ROUNDING
        if not self._from <= time < self._until:
            span = bisect_right(self._changes, time) - 1
            self._from, self._until = self._changes[span : span + 2]
            if span not in self._spans:
                self._spans[span] = self._amounts_from(self._from)
            self._current = self._spans[span]
        return self._current

    def _amounts_from(self, time: float) -> Mapping[str, float]:
        """What holds from a change on until the next one."""
        holding = [fault for fault in self.faults if fault.start <= time < fault.end]
        return _amounts(self._effects | {fault.what: fault.amount for fault in holding})


def _amounts(given: Mapping[str, float]) -> Mapping[str, float]:
    amounts = {
        name: given.get(name, given.get(effect.follows or name, effect.default))
        for name, effect in EFFECTS.items()
    }
    return MappingProxyType(amounts)


def _require_containers(effects: object, faults: object) -> None:
    if not isinstance(effects, Mapping):
        raise ValueError(
            f"effects must be amounts by name, such as {{'stereo.defocus': 1.0}}, got {effects!r}"
        )
    if isinstance(faults, (str, Mapping)) or not isinstance(faults, Iterable):
        raise ValueError(
            f"faults must be a list, such as [{{'what': 'gps.outage'}}], got {faults!r}"
        )
