"""Vehicles against the geometry that they should have, and their reports against the truth."""

import math

import numpy as np
import pytest

from grouser.envs.plane.vehicles import Moved, SteeredVehicle, TrackedVehicle, Vehicle, standing_at
from grouser.geometry import compose, exp
from grouser.rig_motion import Steering

DT = 0.001
STEERING = Steering(4.0, 3.0, math.radians(30), math.radians(20), 0.3, math.radians(3))


def driven(vehicle: Vehicle, actions: np.ndarray, start: tuple[float, ...] = (0, 0, 0)) -> Moved:
    moved = standing_at(np.array(start, dtype=float))
    for action in actions:
        moved = vehicle.drive(moved, action)
    return moved


def test_the_rear_axle_of_a_steered_vehicle_does_not_slip_sideways() -> None:
    vehicle = SteeredVehicle(STEERING, dt=DT)
    rng = np.random.default_rng(0)
    moved = standing_at(np.array([3.0, -2.0, 0.7]))
    for action in rng.uniform(-1, 1, (2000, 2)):
        before, moved = moved, vehicle.drive(moved, action)
        rear = [
            m.pose[:2] - STEERING.wheelbase * np.array([math.cos(m.pose[2]), math.sin(m.pose[2])])
            for m in (before, moved)
        ]
        way, heading = rear[1] - rear[0], (before.pose[2] + moved.pose[2]) / 2
        sideways = -math.sin(heading) * way[0] + math.cos(heading) * way[1]
        assert abs(sideways) < 1e-5  # of up to 3e-3 m: what Euler's steps leave


def test_with_its_wheel_held_a_steered_vehicle_circles_about_a_point_beside_its_rear_axle() -> None:
    vehicle = SteeredVehicle(STEERING, dt=DT)
    angle = 0.3
    moved = Moved(np.zeros(3), np.zeros(3), np.array([3.0, angle]))
    centre = np.array([-STEERING.wheelbase, STEERING.wheelbase / math.tan(angle)])
    radius = STEERING.wheelbase / math.sin(angle)
    for _ in range(5000):
        moved = vehicle.drive(moved, np.array([1.0, angle / STEERING.max_angle]))
        assert np.linalg.norm(moved.pose[:2] - centre) == pytest.approx(radius, abs=5e-3)


def test_the_wheel_turns_no_faster_and_no_further_than_it_can() -> None:
    vehicle = SteeredVehicle(STEERING, dt=0.1)
    turned = [driven(vehicle, np.ones((n, 2))).controls[1] for n in range(1, 30)]
    steps = np.diff([0.0, *turned])
    assert steps.max() == pytest.approx(math.radians(2))
    assert turned[-1] == pytest.approx(math.radians(30)) and steps[-1] == pytest.approx(
        0, abs=1e-12
    )


def test_tracks_go_along_exact_arcs_however_finely_they_are_divided() -> None:
    coarse = TrackedVehicle(width=1.5, top_speed=2.0, noise=0.0, dt=1.0)
    fine = TrackedVehicle(width=1.5, top_speed=2.0, noise=0.0, dt=0.01)
    for action in np.random.default_rng(1).uniform(-1, 1, (50, 2)):
        once = driven(coarse, action[None], (1.0, 2.0, 3.0)).pose
        left, right = 2.0 * action
        arc = exp([(left + right) / 2, 0.0, (right - left) / 1.5])
        np.testing.assert_allclose(once, compose([1.0, 2.0, 3.0], arc), atol=1e-12)
        many = driven(fine, np.tile(action, (100, 1)), (1.0, 2.0, 3.0)).pose
        np.testing.assert_allclose(many, once, atol=1e-9)


@pytest.mark.parametrize("action", [(1.0, 1.0), (1.0, -1.0), (0.5, 0.2), (0.0, 0.0)])
def test_the_twist_is_what_leads_to_the_next_pose(action: tuple[float, float]) -> None:
    tracked = TrackedVehicle(width=1.5, top_speed=2.0, noise=0.0, dt=0.1)
    moved = driven(tracked, np.array([action]))
    np.testing.assert_allclose(exp(0.1 * moved.twist), moved.pose, atol=1e-12)
    steered = SteeredVehicle(STEERING, dt=DT)
    moved = driven(steered, np.array([action]))
    np.testing.assert_allclose(exp(DT * moved.twist), moved.pose, atol=1e-6)


def test_reports_scatter_about_the_controls_by_their_sigmas() -> None:
    moved = Moved(np.zeros(3), np.zeros(3), np.array([1.5, -0.2]))
    vehicles: list[tuple[Vehicle, list[float]]] = [
        (SteeredVehicle(STEERING, dt=DT), [STEERING.sigma_speed, STEERING.sigma_angle]),
        (TrackedVehicle(width=1.0, top_speed=2.0, noise=0.1, dt=1.0), [0.15, 0.02]),
    ]
    for vehicle, sigmas in vehicles:
        rng = np.random.default_rng(2)
        told = np.array([vehicle.report(moved, rng) for _ in range(20_000)])
        assert all(report in vehicle.space for report in told[:100])
        np.testing.assert_allclose(told.mean(axis=0), moved.controls, atol=4 * max(sigmas) / 141)
        np.testing.assert_allclose(told.std(axis=0), sigmas, rtol=0.03)
