"""Physics without wires: how simulated robots follow commanded velocities."""
