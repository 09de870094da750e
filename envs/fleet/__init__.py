"""Many environments at once: crews of them in processes of their own, and what they share."""
