"""What noise costs the RoboMaster's task."""
