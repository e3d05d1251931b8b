"""Experiments: sweeps over many seeded runs, and the tables made of them."""
