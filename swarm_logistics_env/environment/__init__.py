"""The PettingZoo environment: its array methods, their dict view, spaces, rewards and options."""
