"""Scans as a graph of poses, with loops that are closed when in no doubt."""
