"""The paper's five systems with their task controllers, and what draws the simulated ones."""
