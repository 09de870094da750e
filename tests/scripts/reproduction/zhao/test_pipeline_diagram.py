"""Fig. 3 is what the code does."""

from grouser.scripts.reproduction.zhao.pipeline_diagram import parts, stages, watched_update


def test_the_stages_of_the_paper_are_seen_in_their_order() -> None:
    steps = stages(watched_update())
    names = [step.name for step in steps]
    order = [
        next(k for k, name in enumerate(names) if name.endswith(ending))
        for ending in (".extract", "Predictor.predict", ".look", ".judge", ".replaces")
    ]
    assert order == sorted(order)
    look = next(step for step in steps if step.name.endswith(".look"))
    seen = parts(look)
    matched = next(k for k, name in enumerate(seen) if name.endswith(".match"))
    assert matched < seen.index("OnePointRansac.solve") < seen.index("refine")
    judge = next(step for step in steps if step.name.endswith(".judge"))
    assert "RelativeFilter.fuse" in parts(judge)


def test_another_solver_is_another_diagram() -> None:
    look = next(s for s in stages(watched_update("five-point-ransac")) if "look" in s.name)
    assert "FivePointRansac.solve" in parts(look) and "OnePointRansac.solve" not in parts(look)


def test_stages_say_what_they_do() -> None:
    assert all(step.says for step in stages(watched_update()))
