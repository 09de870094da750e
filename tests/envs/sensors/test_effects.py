"""The vocabulary of what may be wrong: complete, bounded, and clear about what it refuses."""

import json

import pytest

from grouser.envs.sensors.effects import EFFECTS, NOISES, SWITCH, checked_amount, effects_table


def test_every_default_is_an_amount_that_the_effect_may_have() -> None:
    for name, effect in EFFECTS.items():
        assert effect.least <= effect.default <= effect.most, name
        assert effect.unit != SWITCH or effect.default in (0, 1)
        if effect.follows is not None:
            assert EFFECTS[effect.follows].default == effect.default


def test_the_defaults_are_noise_and_ticks_and_nothing_else() -> None:
    on = {name for name, e in EFFECTS.items() if e.default != 0 and e.follows is None}
    assert on == {
        "stereo.read_noise",
        "lidar.range_noise",
        "lidar.bearing_noise",
        "tracks.noise",
        "tracks.resolution",
        "imu.acceleration_noise",
        "imu.rate_noise",
        "gps.noise",
    }
    assert set(NOISES) <= set(EFFECTS)


def test_each_effect_of_either_eye_is_one_of_both() -> None:
    followed = {e.follows for e in EFFECTS.values()} - {None}
    alone = {name for name in EFFECTS if name.startswith("stereo.")} - followed
    assert alone == {
        "stereo.gain_mismatch",
        "stereo.miscalibration",
        "stereo.miscalibration_yaw",
        "stereo.disparity_offset",
        "stereo.desynchronisation",
    }


def test_the_table_has_every_effect_once() -> None:
    rows = effects_table().splitlines()[2:]
    own = [name for name, effect in EFFECTS.items() if effect.follows is None]
    assert len(rows) == len(own)
    for name, row in zip(own, rows, strict=True):
        assert f"| `{name}`" in row and EFFECTS[name].meaning in row
    assert "| `stereo.darkness` (left, right) | 0 | 0 | 1 | share |" in effects_table()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("lidar.droput", "no effect is named 'lidar.droput'; did you mean 'lidar.dropout'"),
        ("lidar.sigma", "lidar has: lidar.range_noise, lidar.bearing_noise"),
        ("radar.noise", r"known: stereo\.\*, left\.\*, right\.\*, lidar\.\*, tracks\.\*, imu"),
        ("noise", "no effect is named 'noise'"),
        (7, "no effect is named 7"),
    ],
)
def test_an_unknown_effect_is_refused_with_near_names(name: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        checked_amount(name, 0.1)


@pytest.mark.parametrize("amount", [-0.1, 1.1, float("nan"), float("inf"), "much", None])
def test_an_amount_out_of_range_is_refused(amount: object) -> None:
    with pytest.raises(ValueError, match=r"lidar.dropout .* a number from 0 to 1 \(probability\)"):
        checked_amount("lidar.dropout", amount)


def test_a_switch_is_on_or_off() -> None:
    assert checked_amount("gps.outage", True) == 1.0
    with pytest.raises(ValueError, match="gps.outage .* must be 0 or 1, got 0.5"):
        checked_amount("gps.outage", 0.5)


def test_the_vocabulary_is_plain_numbers_and_words() -> None:
    assert json.loads(json.dumps({name: e.default for name, e in EFFECTS.items()}))
