"""Attacks on the message of the paper's Discovery and on keys: one file an attack, all measured in the same way."""
