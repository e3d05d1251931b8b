"""Detectors: they score every candidate symbol of every window against a glimpse."""
