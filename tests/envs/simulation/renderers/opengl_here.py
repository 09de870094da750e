"""Whether OpenGL can be tested on this machine."""

import subprocess
import sys

import pytest

_PROBE = "from grouser.envs.simulation.renderers.gl_context import shared_context; shared_context()"


def why_not() -> str:
    """Empty, or what is missing; asked in another process, so that this one may still fork."""
    probe = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True)
    return "" if probe.returncode == 0 else probe.stderr.strip().splitlines()[-1]


REASON = why_not()
needs_opengl = pytest.mark.skipif(bool(REASON), reason=REASON or "OpenGL is here")
