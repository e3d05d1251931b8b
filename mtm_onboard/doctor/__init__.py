"""What is looked at before a robot is driven. Nothing here sends a command or makes a robot ready to move."""
