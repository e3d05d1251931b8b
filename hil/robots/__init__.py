"""Simulators that speak the real protocols and plug in where the hardware would."""
