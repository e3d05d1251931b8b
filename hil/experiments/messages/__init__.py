"""Whole messages: framed ones received from a fleet, and frames decoded from noisy scores."""
