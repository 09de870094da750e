"""Maps of lines on disk: GeoJSON that any viewer opens, and that comes back to the last bit.

A feature is a line between its known ends, a LineString. GeoJSON means longitude and latitude by
its coordinates unless those involved agreed on something else (RFC 7946, section 4); here they are
metres, which the property `frame` of every feature says.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from grouser.estimators.line_slam.map import LineMap
from grouser.geometry import Array

FORMAT = "grouser line map 1"
"""What the member `format` of a file says."""

FRAME = "metres in the frame of the start, x forward, y left; not longitude and latitude"
"""What `frame` says."""

_MOVED = 1e-3
"""m; ends that are farther from where the properties have them were moved by an editor."""


def save_line_map(path: str | Path, line_map: LineMap) -> None:
    """Write a map; `load_line_map` reads the same map back.

    The properties of line i are r [m], alpha [rad], t_min and t_max [m], open_min and open_max,
    count, sigma_r [m] and sigma_alpha_degrees for the eye, and its covariance: two rows, of r and
    of alpha, beginning with its own 2 x 2 block, then those with lines i + 1, i + 2, and so on.
    """
    features = [_feature(line_map, i) for i in range(len(line_map))]
    collection = {"type": "FeatureCollection", "format": FORMAT, "features": features}
    Path(path).write_text(json.dumps(collection, allow_nan=False, indent=1) + "\n")


def load_line_map(path: str | Path) -> LineMap:
    """Read a map that `save_line_map` wrote.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is not such a map, or its lines were moved without their r and alpha; the
            message names the file and the line.
    """
    try:
        collection = json.loads(Path(path).read_text())
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not JSON: {error}") from error
    if not isinstance(collection, dict) or collection.get("format") != FORMAT:
        raise ValueError(
            f"{path} is not a line map: it has no member 'format' that says {FORMAT!r}; "
            "write maps by save_line_map or `grouser map`"
        )
    features = collection.get("features", [])
    tables = [_properties(path, i, feature) for i, feature in enumerate(features)]
    try:
        line_map = _assembled(tables)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path} is not a line map: {error}") from error
    _require_ends(path, line_map, features)
    return line_map


def line_map_of(source: "LineMap | str | Path") -> LineMap:
    """A map as it is, or from its file, for an estimator that takes either.

    Raises:
        FileNotFoundError, ValueError: as `load_line_map`.
    """
    return source if isinstance(source, LineMap) else load_line_map(source)


def _feature(line_map: LineMap, i: int) -> dict[str, Any]:
    r, alpha = line_map.lines[i].tolist()
    t_min, t_max = line_map.extents[i].tolist()
    open_min, open_max = line_map.open_ends[i].tolist()
    rows = line_map.covariance[2 * i : 2 * i + 2, 2 * i :]
    sigma_r, sigma_alpha = np.sqrt(np.diag(rows[:, :2])).tolist()
    return {
        "type": "Feature",
        "id": i,
        "geometry": {"type": "LineString", "coordinates": line_map.ends[i].tolist()},
        "properties": {
            "frame": FRAME,
            "r": r,
            "alpha": alpha,
            "t_min": t_min,
            "t_max": t_max,
            "open_min": open_min,
            "open_max": open_max,
            "count": int(line_map.counts[i]),
            "sigma_r": sigma_r,
            "sigma_alpha_degrees": float(np.degrees(sigma_alpha)),
            "covariance": rows.tolist(),
        },
    }


_READ = ("r", "alpha", "t_min", "t_max", "open_min", "open_max", "count", "covariance")


def _properties(path: str | Path, i: int, feature: Any) -> dict[str, Any]:
    try:
        return {name: feature["properties"][name] for name in _READ}
    except (KeyError, TypeError) as error:
        raise ValueError(
            f"{path}: line {i} lacks properties; it needs {', '.join(_READ)} ({error!r})"
        ) from error


def _assembled(tables: list[dict[str, Any]]) -> LineMap:
    n = len(tables)
    covariance = np.zeros((2 * n, 2 * n))
    for i, table in enumerate(tables):
        rows = np.array(table["covariance"], dtype=np.float64)
        if rows.shape != (2, 2 * (n - i)):
            raise ValueError(
                f"line {i} of {n} must have a covariance of shape {(2, 2 * (n - i))}, "
                f"got {rows.shape}"
            )
        covariance[2 * i : 2 * i + 2, 2 * i :] = rows
        covariance[2 * i :, 2 * i : 2 * i + 2] = rows.T
    return LineMap(
        lines=_pairs(tables, "r", "alpha"),
        covariance=covariance,
        extents=_pairs(tables, "t_min", "t_max"),
        open_ends=np.array([(t["open_min"], t["open_max"]) for t in tables]).reshape(n, 2),
        counts=np.array([table["count"] for table in tables]).reshape(n),
    )


def _pairs(tables: list[dict[str, Any]], first: str, second: str) -> Array:
    pairs = [(table[first], table[second]) for table in tables]
    return np.array(pairs, dtype=np.float64).reshape(len(tables), 2)


def _require_ends(path: str | Path, line_map: LineMap, features: list[Any]) -> None:
    """Whoever moved a line in an editor would otherwise wonder why nothing changed."""
    for i, (ends, feature) in enumerate(zip(line_map.ends, features, strict=True)):
        told = np.array(feature.get("geometry", {}).get("coordinates", []), dtype=np.float64)
        if told.shape != (2, 2) or np.abs(told - ends).max() > _MOVED:
            raise ValueError(
                f"{path}: the ends of line {i} are {told.tolist()} m, but its r, alpha, t_min and "
                f"t_max lead to {ends.tolist()}; an estimator reads the latter, change both"
            )
