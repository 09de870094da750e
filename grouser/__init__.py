"""Grouser: tracked robots that navigate on an estimated pose.

Importing it registers the environments by name and imports nothing heavy; physics, images and
kernels load when an environment is made.
"""

from gymnasium.envs.registration import register

__version__ = "0.1.0"

register(
    id="grouser/TrackedRobot-v0",
    entry_point="grouser.envs.tracked_robot:TrackedRobotEnv",
    vector_entry_point="grouser.envs.vector:tracked_robots",
)
register(id="grouser/Replay-v0", entry_point="grouser.envs.replay:ReplayEnv")
register(id="grouser/LineWorld-v0", entry_point="grouser.envs.line_world:LineWorldEnv")
register(id="grouser/GoalNav-v0", entry_point="grouser.agents.navigation:GoalNavEnv")
