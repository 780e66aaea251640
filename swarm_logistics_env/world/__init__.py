"""What is simulated: scenario, floor, warehouse, robots' bodies and senses, motion, pictures."""
