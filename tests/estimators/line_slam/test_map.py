"""The band about a line against Monte Carlo; files that come back exact; what is no map."""

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grouser.estimators.line_slam.lines import line_through, places_along
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.map_file import FRAME, line_map_of, load_line_map, save_line_map
from tests.estimators.line_slam.maps import random_map


def test_the_band_is_as_wide_as_lines_of_that_covariance_scatter() -> None:
    line_map = random_map(4, sigma=0.02)
    places = np.tile([-30.0, -5.0, 0.0, 8.0, 40.0], (4, 1))
    rng = np.random.default_rng(1)
    errors = rng.multivariate_normal(np.zeros(8), line_map.covariance, 100_000).reshape(-1, 4, 2)
    r, turn = line_map.lines[:, 0] + errors[..., 0], errors[..., 1]
    # Exactly where the wrong line crosses the perpendicular at t: n . p = r and u . p = t.
    across = (r[..., None] - places * np.sin(turn)[..., None]) / np.cos(turn)[..., None]
    np.testing.assert_allclose(line_map.offset_sigmas(places), across.std(axis=0), rtol=0.02)


def test_ends_lie_on_the_line_where_the_extents_say() -> None:
    line_map = random_map(5)
    ends = line_map.ends
    np.testing.assert_allclose(places_along(line_map.lines[:, None], ends), line_map.extents)
    np.testing.assert_allclose(
        np.cos(line_through(ends[:, 0], ends[:, 1])[:, 1] - line_map.lines[:, 1]), 1.0
    )
    blocks = [line_map.covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(5)]
    np.testing.assert_array_equal(line_map.line_covariances, blocks)


@pytest.mark.parametrize("n", [0, 1, 30])
def test_a_map_comes_back_from_its_file_to_the_last_bit(n: int, tmp_path: Path) -> None:
    line_map = random_map(n)
    save_line_map(tmp_path / "map.geojson", line_map)
    back = load_line_map(tmp_path / "map.geojson")
    assert back == line_map and back != random_map(n + 1)
    for name in ("lines", "covariance", "extents", "open_ends", "counts"):
        assert getattr(back, name).tobytes() == getattr(line_map, name).tobytes()
    assert line_map_of(str(tmp_path / "map.geojson")) == line_map == line_map_of(line_map)


def test_the_file_is_geojson_and_says_that_it_is_in_metres(tmp_path: Path) -> None:
    line_map = random_map(3)
    save_line_map(tmp_path / "map.geojson", line_map)
    collection = json.loads((tmp_path / "map.geojson").read_text())
    assert collection["type"] == "FeatureCollection"
    for feature, ends in zip(collection["features"], line_map.ends, strict=True):
        assert feature["type"] == "Feature" and feature["geometry"]["type"] == "LineString"
        assert feature["geometry"]["coordinates"] == ends.tolist()
        assert feature["properties"]["frame"] == FRAME and "metres" in FRAME


def test_maps_are_frozen_and_stay_so_when_pickled() -> None:
    line_map = random_map(2)
    for one in (line_map, pickle.loads(pickle.dumps(line_map))):
        assert one == line_map
        with pytest.raises(ValueError, match="read-only"):
            one.covariance[0, 0] = 1.0
    assert len({line_map, random_map(2)}) == 1


def changed(**changes: Any) -> dict[str, Any]:
    line_map = random_map(2)
    names = ("lines", "covariance", "extents", "open_ends", "counts")
    return {name: getattr(line_map, name) for name in names} | changes


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lines": [[1.0, 2.0]]}, r"covariance of a map of 1 lines must have shape \(2, 2\)"),
        ({"lines": [[1.0, 2.0], [np.nan, 0]]}, "lines of a line map must be finite"),
        ({"covariance": np.triu(np.ones((4, 4)))}, "must be symmetric"),
        ({"covariance": -np.eye(4)}, "no negative variance"),
        ({"extents": [[1.0, 0.0], [0.0, 1.0]]}, "must not end before they begin"),
        ({"counts": [1.5, 2]}, "counts of a line map must be .*int64"),
        ({"counts": [-1, 2]}, "zero or more"),
    ],
)
def test_what_is_no_map_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        LineMap(**changed(**changes))


def edited(tmp_path: Path, edit: Any) -> Path:
    path = tmp_path / "map.geojson"
    save_line_map(path, random_map(2))
    collection = json.loads(path.read_text())
    edit(collection)
    path.write_text(json.dumps(collection))
    return path


def _move(collection: Any) -> None:
    collection["features"][1]["geometry"]["coordinates"][0][0] += 0.5


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda c: c.pop("format"), "no member 'format'.*grouser map"),
        (lambda c: c["features"][1]["properties"].pop("alpha"), "line 1 lacks properties.*alpha"),
        (lambda c: c["features"].pop(), "line 0 of 1 must have a covariance of shape"),
        (_move, "the ends of line 1 are.*change both"),
    ],
)
def test_broken_files_are_refused_by_file_and_line(tmp_path: Path, edit: Any, words: str) -> None:
    with pytest.raises(ValueError, match=rf"map.geojson.*{words}"):
        load_line_map(edited(tmp_path, edit))


def test_what_is_no_file_or_no_json_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        load_line_map(tmp_path / "nowhere.geojson")
    (tmp_path / "map.geojson").write_text("{")
    with pytest.raises(ValueError, match="map.geojson is not JSON"):
        load_line_map(tmp_path / "map.geojson")
