"""A running session and what an operator may ask of it."""
