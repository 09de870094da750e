"""`grouser abuse` tells what becomes of spoilt sensors, and refuses in a line."""

import pytest

from grouser.scripts.abuse import Abuse
from grouser.scripts.cli import main
from grouser.scripts.usage import UsageError


def test_a_row_for_every_spoil(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--estimators", "dead-reckoning", "--spoils", "black", "left track zero"]
    assert main(["abuse", *options, "--seeds", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "dead-reckoning, 1 drives, frames 60 to 90 spoilt" in lines[0]
    # It never looks, and so never tracks; the dark is all the same to it.
    black, zero = (line.split() for line in lines[2:4])
    assert black[:4] == ["black", "0", "30", "0"] and black[5:] == ["never", "0.0", "%"]
    assert zero[:3] == ["left", "track", "zero"] and zero[3:6] == ["0", "30", "0"]
    assert float(black[4]) > 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (Abuse(seeds=0), "--seeds must be at least 1, got 0"),
        (Abuse(spoils=("blak",)), "no spoil is named 'blak'; did you mean 'black'? known: black"),
        (Abuse(estimators=("one-point",)), "no estimator is named 'one-point'"),
        (Abuse(estimators=("ground-truth",)), "nothing of what is spoilt"),
    ],
)
def test_refusals(options: Abuse, words: str) -> None:
    with pytest.raises(UsageError) as refused:
        options.run()
    assert words in str(refused.value)
