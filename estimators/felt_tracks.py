"""Tracks with an inertial unit: what predicts and the gyroscope both know which way is up.

The gyroscope also tells where a track spun.
"""

from grouser.estimators.base import Observation
from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.estimators.inclination import Inclination
from grouser.estimators.slope import SlopeOptions
from grouser.estimators.slope_predictor import SlopePredictor
from grouser.estimators.spinning import SpinningPredictor
from grouser.rig import Imu, TrackGeometry


def felt_tracks(
    observation: Observation,
    *,
    tracks: TrackGeometry,
    imu: Imu,
    dt: float,
    icr: IcrOptions,
    slope: SlopeOptions,
    gyro: GyroOptions,
) -> tuple[SlopePredictor, Gyro]:
    """The predictor follows the inclination, and the gyroscope reads it: ask them in this order.

    Args:
        observation: the first one, with a reading of the inertial unit.
        dt: between two observations, s.
    """
    width = tracks.effective_width
    upright, inclination = Gyro(imu, dt, GyroOptions()), Inclination(imu, observation)
    upright.reset(observation)
    doubted = SpinningPredictor(IcrPredictor(tracks, icr), upright, width)
    predictor = SlopePredictor(doubted, inclination, width, slope)
    return predictor, Gyro(imu, dt, gyro, inclination)
