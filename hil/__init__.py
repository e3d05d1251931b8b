"""Hardware in the loop: simulated robots on their real wires, worlds, and the sensors that film them."""
