"""Paper 2's planar world: line segments, vehicles without mass, sensors that see the segments."""
