"""An estimator on a drive that it has no say in: what its error is outside the loop."""

import numpy as np

from grouser.agents.drive import steps
from grouser.agents.drivers import make_driver
from grouser.agents.episode import Trial, goal_task
from grouser.agents.evaluation import BASELINE
from grouser.estimators.evaluation.metrics import ate_se2


def replayed_ate(trial: Trial) -> float:
    """Absolute trajectory error of the trial's estimator, m, on the drive that the trial's driver
    makes under the true pose: same world, same actions, same sensor noise."""
    driver = make_driver(trial.policy)
    task = {key: value for key, value in trial.task.items() if key != "estimator_options"}
    leader = goal_task(driver, BASELINE, task)
    actions = [step.action for step in steps(leader, driver, trial.seed)]
    leader.close()
    # Asked whether to stop, this one never does, so that its drive is as long as the leader's.
    follower = goal_task(driver, trial.estimator, trial.task, policy_sensors=(), stop="agent")
    follower.reset(seed=trial.seed)
    truth, believed = [], []
    for action in actions:
        info = follower.step(np.append(action[:2], -1.0).astype(np.float32))[4]
        truth.append(info["true_pose"])
        believed.append(follower.believed.pose)
    follower.close()
    return ate_se2(np.array(truth), np.array(believed))
