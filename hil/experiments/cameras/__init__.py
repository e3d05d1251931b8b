"""What evidence a camera leaves that is not on a stand, or that sees markers at an angle."""
