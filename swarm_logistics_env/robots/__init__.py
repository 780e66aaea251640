"""Robots: policies as the programs of single robots."""
