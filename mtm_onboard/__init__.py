"""What runs on the robot: a keyed message added to its velocity commands. Imports with numpy alone."""
