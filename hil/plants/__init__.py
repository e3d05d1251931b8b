"""Physics without wires: how simulated robots follow the velocities that they are commanded."""
