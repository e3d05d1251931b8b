"""What the tracker saw and the decode read, drawn on the film: as a film, a still, or a contact sheet."""
