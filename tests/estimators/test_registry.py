"""Estimators by name: Grouser's own, those of other packages, and what is refused."""

from collections.abc import Iterator
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest

from grouser.estimators import PoseEstimate, PoseEstimator, make, names, register, registry
from grouser.estimators.base import Observation, check_observation_keys, readable
from grouser.estimators.dead_reckoning import DeadReckoning
from grouser.rig import Rig, TrackGeometry

RIG = Rig(dt=0.1, tracks=TrackGeometry(0.4, 0.08, 0.55))


class Listener(PoseEstimator):
    """Records the options that it is made with."""

    requires = frozenset({"tracks", "stamp"})
    optional = frozenset({"imu", "gps"})

    def __init__(self, rig: Rig, **options: Any) -> None:
        self.options = options

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        raise NotImplementedError

    def update(self, observation: Observation) -> PoseEstimate:
        raise NotImplementedError


class Spy(Listener):
    optional = frozenset({"true_pose"})


class Sneak(Listener):
    """Asks for the truth once it is made, when the registry no longer looks."""

    def __init__(self, rig: Rig) -> None:
        self.requires = frozenset({"true_pose"})  # type: ignore[misc]


@pytest.fixture(autouse=True)
def _fresh(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(registry, "_registry", dict(registry._registry))
    yield
    registry._load_entry_points.cache_clear()


def test_grousers_own_names_are_known_and_sorted() -> None:
    own = {"ground-truth", "dead-reckoning", "one-point-ransac", "five-point-ransac"}
    assert own <= set(names()) and names() == sorted(names())


def test_options_override_those_of_the_name() -> None:
    register("listener", f"{__name__}:Listener", volume=1, bass=2)
    made = make("listener", RIG, volume=11)
    assert isinstance(made, Listener) and made.options == {"volume": 11, "bass": 2}


def test_registering_the_same_twice_is_harmless_and_another_is_refused() -> None:
    register("listener", f"{__name__}:Listener")
    register("listener", f"{__name__}:Listener")
    with pytest.raises(ValueError, match="'listener' is registered as .*; choose another"):
        register("listener", f"{__name__}:Spy")
    with pytest.raises(ValueError, match=f"choose another name for {__name__}:Listener"):
        register("listener", f"{__name__}:Listener", volume=3)


@pytest.mark.parametrize("entry_point", ["module.Class", ":Class", "module:", "module:a.b"])
def test_a_malformed_entry_point_is_refused(entry_point: str) -> None:
    with pytest.raises(ValueError, match="is not 'package.module:Class'"):
        register("x", entry_point)


def test_an_unknown_name_gets_a_suggestion_and_the_list() -> None:
    with pytest.raises(ValueError, match=r"'one-point-ransak'; did you mean 'one-point-ransac'\?"):
        make("one-point-ransak", RIG)
    with pytest.raises(ValueError, match=r"no estimator is named 'zzz'; known: .*dead-reckoning"):
        make("zzz", RIG)


@pytest.mark.parametrize("what", ["Nothing", "RIG", "Rig"])
def test_what_is_no_estimator_class_is_refused(what: str) -> None:
    register("odd", f"{__name__}:{what}")
    with pytest.raises(TypeError, match="registered as 'odd', is not a PoseEstimator class"):
        make("odd", RIG)


def test_optional_truth_is_refused_too() -> None:
    register("spy", f"{__name__}:Spy")
    with pytest.raises(ValueError, match=r"'spy' asks for the truth \(\['true_pose'\]\)"):
        make("spy", RIG)


def test_an_instance_cannot_ask_for_more_than_its_class() -> None:
    register("sneak", f"{__name__}:Sneak")
    shown = {"tracks": np.zeros(2), "stamp": np.zeros(1)}
    assert "true_pose" not in readable(make("sneak", RIG), shown, {"true_pose": np.ones(3)})


def test_other_packages_register_by_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    found = EntryPoint("third-party", f"{__name__}:Listener", registry.ENTRY_POINT_GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: [found] * (group == found.group))
    registry._load_entry_points.cache_clear()
    assert "third-party" in names()
    assert isinstance(make("third-party", RIG), Listener)


def test_a_package_that_takes_a_known_name_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    found = EntryPoint("dead-reckoning", f"{__name__}:Listener", registry.ENTRY_POINT_GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: [found])
    registry._load_entry_points.cache_clear()
    with pytest.raises(ValueError, match="package '.*': .*dead-reckoning.* uninstall that package"):
        names()


def test_a_module_that_cannot_be_imported_is_told_with_the_estimators_name() -> None:
    register("absent", "no_such_package.estimator:Absent")
    with pytest.raises(ImportError, match=r"'absent' cannot be imported from no_such_package\."):
        make("absent", RIG)


def test_readable_hands_over_what_is_declared_and_nothing_else() -> None:
    shown = {key: np.zeros(1) for key in ("tracks", "stamp", "imu", "lidar")}
    seen = readable(Listener(RIG), shown, {"true_pose": np.ones(3)})
    assert set(seen) == {"tracks", "stamp", "imu"}


def test_what_is_missing_is_named_beside_what_is_there() -> None:
    words = (
        r"DeadReckoning requires observations \['stamp'\] and one of \['odometry', 'tracks'\], but "
        r"the environment gives \['left', 'stamp'\], without \['odometry or tracks'\]; make the "
        r"environment with sensors="
    )
    with pytest.raises(ValueError, match=words):
        check_observation_keys(DeadReckoning(RIG), ["stamp", "left"])


def test_what_only_a_source_reads_is_not_read_without_one() -> None:
    images = {"left", "right"}
    assert not images & registry.optional_keys("icr-ekf", {})
    assert images <= registry.optional_keys("icr-ekf", {"source": "one-point-ransac"})
    assert not images & registry.keys_read(["icr-ekf", "dead-reckoning"])
    assert images <= registry.keys_read(["icr-ekf", "one-point-ransac"])
