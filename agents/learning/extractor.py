"""The features of `grouser.agents.learning.features`, inside a network of PyTorch."""

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from grouser.agents.learning.features import features, n_features


class Features(BaseFeaturesExtractor):
    """Has no weights: it computes the features with NumPy, so that there is one definition."""

    def __init__(self, observation_space: spaces.Dict) -> None:
        super().__init__(observation_space, n_features(observation_space))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """(batch, n) of a batch of observations."""
        plain = {key: value.detach().cpu().numpy() for key, value in observations.items()}
        return torch.from_numpy(np.ascontiguousarray(features(plain)))
