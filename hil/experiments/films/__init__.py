"""What encoders leave of a message in a film."""
