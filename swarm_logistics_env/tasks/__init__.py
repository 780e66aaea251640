"""Tasks: what a study can play."""
