"""Monocular EKF SLAM in inverse depth, after Civera, Grasa, Davison and Montiel, "1-Point RANSAC
for extended Kalman filtering", Journal of Field Robotics 27(5), 2010.

The filter is camera-centred, as theirs is: its points are those that the left camera sees, in the
camera's own frame; the start is what drifts away. A point is (u, v, inverse depth) in the current
image instead of their six numbers about the place where it was first seen: as the frame moves with
the camera, nothing of that place is needed, a point at infinity stays finite, and the measurement
is nearly linear. One camera does not know the scale; the tracks do.
"""
