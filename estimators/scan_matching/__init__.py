"""Where a lidar scan was taken, found by laying it over scans taken before."""
