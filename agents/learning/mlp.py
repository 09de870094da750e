"""A trained policy as plain matrices: it drives without PyTorch, and faster."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grouser.agents.learning.features import features

Layer = NDArray[np.float32]

_HIDDEN: Final[Mapping[str, Callable[[Layer], Layer]]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, np.float32(0)),
}


@dataclass(frozen=True, slots=True, eq=False)
class MlpPolicy:
    """Layers, the last one of actions; those of a Gaussian policy are drawn around it and clipped.

    Its draws are a part of what a policy has learnt: they free it where the mean is stuck, and the
    mean of clipped draws is not the clipped mean.
    """

    weights: tuple[Layer, ...]
    """Each (outputs, inputs)."""
    biases: tuple[Layer, ...]
    """Each (outputs,)."""
    hidden: str
    """What follows each layer but the last: tanh or relu."""
    sigma: Layer | None
    """(actions,) of draws around the last layer's outputs, that are clipped; None where these are
    squashed by tanh."""

    def __call__(
        self, observation: Mapping[str, Any], rng: np.random.Generator
    ) -> NDArray[np.float32]:
        """An action (..., 2 or 3) in [-1, 1] for observations of GoalNav, one or many.

        Raises:
            ValueError: the observation is not of the kind that it was trained on.
        """
        x: Layer = features(observation)
        n = self.weights[0].shape[1]
        if x.shape[-1] != n:
            raise ValueError(
                f"this policy was trained on {n} features and is shown {x.shape[-1]}, of "
                f"{sorted(observation)}; make the environment with the policy's own `task`"
            )
        for W, b in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = _HIDDEN[self.hidden](x @ W.T + b)
        x = x @ self.weights[-1].T + self.biases[-1]
        if self.sigma is None:
            return np.tanh(x)
        drawn = x + self.sigma * rng.standard_normal(x.shape)
        return np.asarray(np.clip(drawn, -1.0, 1.0), dtype=np.float32)

    def to_bytes(self) -> bytes:
        """As .npz, compressed."""
        held: dict[str, Any] = {f"W{k}": W for k, W in enumerate(self.weights)}
        held |= {f"b{k}": b for k, b in enumerate(self.biases)}
        file = BytesIO()
        if self.sigma is not None:
            held["sigma"] = self.sigma
        np.savez_compressed(file, hidden=self.hidden, **held)
        return file.getvalue()

    @staticmethod
    def from_bytes(data: bytes) -> "MlpPolicy":
        """A policy of what `to_bytes` gave."""
        with np.load(BytesIO(data), allow_pickle=False) as held:
            n = sum(key.startswith("W") for key in held)
            weights, biases = (tuple(held[f"{x}{k}"] for k in range(n)) for x in ("W", "b"))
            sigma = held["sigma"] if "sigma" in held else None
            return MlpPolicy(weights, biases, str(held["hidden"]), sigma)


def plain_policy(model: Any, algorithm: str) -> MlpPolicy | None:
    """A model that `grouser train` trained as plain matrices; None of one with a memory, or with
    features of its own."""
    policy = model.policy
    if algorithm == "ppo":
        owner, layers = policy, [*policy.mlp_extractor.policy_net, policy.action_net]
    elif algorithm == "sac":
        owner, layers = policy.actor, [*policy.actor.latent_pi, policy.actor.mu]
    else:
        return None
    if type(owner.features_extractor).__module__ != "grouser.agents.learning.extractor":
        return None
    sigma = policy.log_std.exp().detach().cpu().numpy() if algorithm == "ppo" else None
    return _plain(layers, sigma)


def _plain(modules: list[Any], sigma: Layer | None) -> MlpPolicy:
    """Linear layers with one kind of function between them."""
    linear = modules[::2]
    (hidden,) = {type(module).__name__.lower() for module in modules[1::2]}
    weights, biases = (
        tuple(getattr(layer, name).detach().cpu().numpy().copy() for layer in linear)
        for name in ("weight", "bias")
    )
    return MlpPolicy(weights, biases, hidden, sigma)
