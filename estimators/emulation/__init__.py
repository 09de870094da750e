"""Emulated estimators: errors like a real estimator's, at a thousandth of its work."""
