"""With numba switched off, everything is plain Python and says the same."""

import os
import subprocess
import sys

SCRIPT = """
import numpy as np
from grouser.envs.sensors.line_observer import OBSERVERS, make_line_observer
import grouser.envs.simulation.surface
segments = np.random.default_rng(0).uniform(-50, 50, (200, 4))
print([make_line_observer(n).observe(segments, (0, 0), 30.0).tobytes().hex() for n in OBSERVERS])
"""


def test_interpreted_is_the_same_as_compiled() -> None:
    said = [
        subprocess.run(
            [sys.executable, "-c", SCRIPT],
            env=os.environ | {"NUMBA_DISABLE_JIT": off},
            capture_output=True,
            check=True,
        ).stdout
        for off in ("0", "1")
    ]
    assert said[0] == said[1] and len(said[0]) > 1000
