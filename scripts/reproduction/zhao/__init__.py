"""Paper 1, section IV: every table and figure again, with this repository's numbers beside them.

Zhao, Kan and Zhan, "1-Point RANSAC application: an independent positioning method for crawler
mobile robots based on binocular stereo vision".
"""
