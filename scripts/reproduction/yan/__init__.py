"""Paper 2, section 3: every figure and table again, with this repository's numbers beside them.

Yan, Yang and Wang, "EKF-SLAM algorithm based on dichotomy", Navigation Positioning and Timing
7(3), 2020.
"""
