"""What carries bytes and frames between a robot and its companion computer, faults included."""
