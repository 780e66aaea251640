"""Verdicts: what the runs say, cell by cell and comparison by comparison."""
