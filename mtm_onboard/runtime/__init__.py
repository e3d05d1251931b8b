"""The loop and what a tick passes through: source, guard, modulator, send; real time."""
