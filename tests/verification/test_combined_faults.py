"""Faults that meet: what they leave, by a slow reference in plain Python."""
