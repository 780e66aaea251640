"""Reports: what a study found, as sections of text and as data."""
