"""A run in figures: one flat object, the same keys for every run, null where a figure cannot be."""

from typing import Any

import numpy as np

from grouser.estimators.base import Status
from grouser.estimators.evaluation.comparison import Run
from grouser.estimators.evaluation.consistency import nees, with_reference_noise
from grouser.estimators.evaluation.metrics import Drift, ate_se2, distances, drift, rpe
from grouser.geometry import Array, lift, wrap

WARM_UP_UPDATES = 5
"""Left out of the times: kernels are compiled and caches filled in the first updates."""

Summary = dict[str, Any]


def summarise(run: Run, source: str, *, reference_sigmas: Array | None = None) -> Summary:
    """The object of one run in results.json.

    `ate_m`, `final_error_m`, `drift_percent`, `drift_deg_per_m`, `rpe_m` and `rpe_deg` are on the
    plane for every estimator; `ate_m` is aligned as `ate_alignment` says, the others are in the
    frame of the start; `smoothed_ate_m` is that of the way as the estimator knew it in the end.
    `final_sigma_m` is what the estimator believes its final error to be, one sigma of the distance.
    Fractions are of the updates, times are those of `update` alone without the first
    WARM_UP_UPDATES.

    Args:
        reference_sigmas: (3,) of x, y [m] and heading [rad] of each true pose, where it is but a
            reference that is noisy, too: `nees_mean` and `final_sigma_m` allow for it.
    """
    return {
        "estimator": run.estimator,
        "source": source,
        "seed": run.seed,
        "steps": len(run.estimates) - 1,
        **_accuracy(run, reference_sigmas),
        **_statuses(run),
        **_times(run.update_ms[WARM_UP_UPDATES:]),
    }


def planar(run: Run) -> Array:
    """Estimated poses (N, 3) of a run."""
    return np.array([estimate.pose for estimate in run.estimates])


def spatial(run: Run) -> Array | None:
    """Estimated poses (N, 4, 4) of a run, where the estimator gives 3-D poses throughout."""
    poses = [estimate.pose_3d for estimate in run.estimates if estimate.pose_3d is not None]
    return np.array(poses) if len(poses) == len(run.estimates) else None


def covariances(run: Run) -> Array:
    """Covariances (N, 3, 3) of x, y, heading of a run."""
    return np.array([estimate.covariance for estimate in run.estimates])


_ACCURACY = (
    "distance_m",
    "ate_m",
    "smoothed_ate_m",
    "ate_alignment",
    "final_error_m",
    "final_sigma_m",
    "final_heading_error_deg",
    "drift_percent",
    "drift_deg_per_m",
    "drift_percent_3d",
    "drift_deg_per_m_3d",
    "rpe_m",
    "rpe_deg",
    "nees_mean",
)


def _accuracy(run: Run, reference_sigmas: Array | None) -> Summary:
    if run.true_poses is None:
        return dict.fromkeys(_ACCURACY)
    truth, estimate = run.true_poses, planar(run)
    T_truth, T_estimate = lift(truth), lift(estimate)
    segments, segments_3d = drift(T_truth, T_estimate), _drift_3d(run)
    translation, angle_deg = _rpe(T_truth, T_estimate)
    P = covariances(run)
    if reference_sigmas is not None:
        P = with_reference_noise(truth, P, reference_sigmas)
    values = (
        float(distances(T_truth)[-1]),
        ate_se2(truth, estimate),
        None if run.smoothed is None else ate_se2(truth, run.smoothed),
        "SE(2)",
        float(np.linalg.norm(estimate[-1, :2] - truth[-1, :2])),
        float(np.sqrt(np.trace(P[-1, :2, :2]))),
        float(np.degrees(np.abs(wrap(estimate[-1, 2] - truth[-1, 2])))),
        segments.translation_percent if segments else None,
        segments.rotation_deg_per_m if segments else None,
        segments_3d.translation_percent if segments_3d else None,
        segments_3d.rotation_deg_per_m if segments_3d else None,
        translation,
        angle_deg,
        _mean_nees(truth, estimate, P),
    )
    return dict(zip(_ACCURACY, values, strict=True))


def _drift_3d(run: Run) -> Drift | None:
    estimate = spatial(run)
    if estimate is None or run.true_poses_3d is None:
        return None
    return drift(run.true_poses_3d, estimate)


def _rpe(T_truth: Array, T_estimate: Array) -> tuple[float | None, float | None]:
    """m, deg; a run that ended where it began has no motion to compare."""
    if len(T_truth) < 2:
        return None, None
    translation, angle = rpe(T_truth, T_estimate)
    return translation, float(np.degrees(angle))


def _mean_nees(truth: Array, estimate: Array, P: Array) -> float | None:
    values = nees(truth, estimate, P)
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if len(known) else None


def _statuses(run: Run) -> Summary:
    statuses = [estimate.status for estimate in run.estimates[1:]]
    updates = len(statuses)
    return {
        "tracking_fraction": statuses.count(Status.TRACKING) / updates if updates else None,
        "lost_fraction": statuses.count(Status.LOST) / updates if updates else None,
    }


def _times(update_ms: Array) -> Summary:
    known = len(update_ms) > 0
    return {
        "ms_per_frame_median": float(np.median(update_ms)) if known else None,
        "ms_per_frame_p95": float(np.percentile(update_ms, 95)) if known else None,
    }
