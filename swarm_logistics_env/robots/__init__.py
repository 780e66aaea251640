"""What leaves the simulator for robots."""
