"""The parts of a decode's picture, each drawn into axes of its own."""
