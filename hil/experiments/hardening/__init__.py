"""Tests of robustness: faults of a wire, damaged traffic, a day of running, the microcontroller's code."""
