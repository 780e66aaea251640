"""Runs: the engines that play them, and the one store that keeps them."""
