"""What passes between the stages: frozen dataclasses of arrays, and what follows from one of them alone."""
