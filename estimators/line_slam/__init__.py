"""Paper 2's wing: lines seen, a filter that maps them, and its rivals."""
