"""How much of everything is done: enough for bounds to mean something, or a little of it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Scale:
    """Numbers of runs, rounds and cases."""

    runs: int = 50
    """Of the Monte Carlo: drives through the course, with noise of their own."""
    start_sigmas_deg: tuple[float, ...] = (0.0, 2.0, 4.0, 7.0, 10.0, 20.0, 30.0)
    """How well the heading of the start is known; the first is the paper's."""
    rounds: int = 3
    """Of table 1, which has so many rows a world."""
    interpreted_rounds: int = 1
    timed_steps: int = 10_000
    """Of a timed simulation, at most; the course has fewer."""
    cases: int = 100_000
    """Random segments on which observers are compared."""
    jacobian_points: int = 200
    """Random states at which Jacobians are compared with finite differences."""


FULL = Scale()
QUICK = Scale(
    runs=2,
    start_sigmas_deg=(0.0, 10.0),
    rounds=1,
    interpreted_rounds=1,
    timed_steps=150,
    cases=2000,
    jacobian_points=10,
)
