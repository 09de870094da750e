"""PyBullet is imported without a word, whatever has become of stderr."""

import subprocess
import sys

import pytest

PROBE = """
from grouser.envs.simulation.bullet import pybullet
client = pybullet.connect(pybullet.DIRECT)
pybullet.disconnect(client)
import sys
print("done", sys.stderr is None)
if sys.stderr is not None:
    print("still there", file=sys.stderr)
"""


@pytest.mark.parametrize(
    ("redirection", "out", "err"),
    [("", "done False\n", "still there\n"), ("2>&-", "done True\n", "")],
)
def test_it_is_imported_quietly(redirection: str, out: str, err: str) -> None:
    command = ["sh", "-c", f'exec "$0" -c "$1" {redirection}', sys.executable, PROBE]
    run = subprocess.run(command, capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, out, err)
