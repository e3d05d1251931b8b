"""The rig: one world, its robots, the real onboard runtime and the sensors, run together to a recording."""
