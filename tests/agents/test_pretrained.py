"""The policy that comes with Grouser reaches its goals, without PyTorch."""

from grouser.agents.drivers import make_driver
from grouser.agents.navigation import GoalNavEnv


def test_it_reaches_most_goals() -> None:
    driver = make_driver("pretrained")
    env = GoalNavEnv(estimator="ground-truth", robot={"dynamics": "fast"}, **driver.task)
    outcomes = []
    for seed in range(300, 320):
        shown, info = env.reset(seed=seed)
        driver.reset(env.rig, env.world)
        while info["outcome"] == "running":
            shown, *_, info = env.step(driver.action(shown, env.believed, env.goal))
        outcomes.append(info["outcome"])
    # Of 100 episodes it fails in 5. Seeds are fixed; the room is for other processors' rounding.
    assert outcomes.count("success") >= 17, outcomes
