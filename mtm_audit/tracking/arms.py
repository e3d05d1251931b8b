"""Tracking a jointed arm of two links."""

# Colours that stay apart in hue from each other, from red targets, pink walls and teal fingertips.
INNER_RGB = (0, 102, 255)
OUTER_RGB = (230, 200, 0)
