"""The family of simulated robots: how much of what each sends is read."""
