"""Policies that learn to drive: training with Stable-Baselines3, and what remains of it after."""
