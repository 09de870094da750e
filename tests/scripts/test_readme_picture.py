"""The README's picture can be made anew."""

from pathlib import Path

import pytest

from grouser.scripts import readme_picture


def test_it_draws_the_robot_and_the_courses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(readme_picture, "STEPS", 6)
    output = tmp_path / "docs" / "picture.png"
    readme_picture.main(output)
    assert output.read_bytes().startswith(b"\x89PNG")
    assert output.stat().st_size > 20_000  # two views and a plot, not an empty page
