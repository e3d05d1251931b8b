"""What every room of the runtime shares: a body velocity and the clocks."""
