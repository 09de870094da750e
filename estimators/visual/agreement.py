"""How well matches agree with motions, many of both: what RANSAC scores its hypotheses by."""

import numpy as np

from grouser.estimators.visual.motion import camera_motion, measure
from grouser.geometry import Array
from grouser.kernels import kernel_using


@kernel_using(camera_motion, measure)
def squared_errors(
    motions: Array,
    reference: Array,
    current: Array,
    noise: Array,
    slack: Array,
    T_base_camera: Array,
    camera: Array,
) -> Array:
    """Squared Mahalanobis errors (k, n) of where matches are seen under motions (k, 6).

    Args: reference, current (n, 3) u, v, d [px]; noise (n, 6) their variances [px^2]; slack (6,)
    variances of what the motions leave open; camera (5,) from `intrinsics`.
    Infinite where a point would be behind the camera.
    """
    number, n = motions.shape[0], reference.shape[0]
    out = np.empty((number, n))
    p, r, S = np.empty(3), np.empty(3), np.empty((3, 3))
    Jw, Jm = np.empty((3, 3)), np.empty((3, 6))
    for h in range(number):
        A, b, dA, db = camera_motion(motions[h], T_base_camera)
        for i in range(n):
            if not measure(reference[i], A, b, dA, db, camera, p, Jw, Jm):
                out[h, i] = np.inf
                continue
            for a in range(3):
                r[a] = current[i, a] - p[a]
                for c in range(a + 1):
                    total = noise[i, 3 + a] if a == c else 0.0
                    for k in range(3):
                        total += Jw[a, k] * noise[i, k] * Jw[c, k]
                    for k in range(6):
                        total += Jm[a, k] * slack[k] * Jm[c, k]
                    S[a, c] = total
            # S = L L^T; the error is |L^-1 r|^2
            L00 = np.sqrt(S[0, 0])
            L10, L20 = S[1, 0] / L00, S[2, 0] / L00
            L11 = np.sqrt(S[1, 1] - L10 * L10)
            L21 = (S[2, 1] - L20 * L10) / L11
            L22 = np.sqrt(S[2, 2] - L20 * L20 - L21 * L21)
            x = r[0] / L00
            y = (r[1] - L10 * x) / L11
            z = (r[2] - L20 * x - L21 * y) / L22
            out[h, i] = x * x + y * y + z * z
    return out
