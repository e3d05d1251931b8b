"""What a runtime must survive: faults, damaged traffic, a day without a pause, the microcontroller."""
