"""How a real robot follows its commands, measured from what was commanded and how it moved."""
