"""The sensors of the auditor: a software camera and a motion-capture system."""
