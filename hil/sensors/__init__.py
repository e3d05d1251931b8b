"""What sees the robots: a software camera and a motion-capture system."""
