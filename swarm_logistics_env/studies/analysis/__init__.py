"""What the runs of a study say beyond the verdicts on its comparisons."""
