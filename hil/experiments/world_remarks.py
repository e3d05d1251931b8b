"""Why cells of a world's tables differ from the paper's, written into the file beside them."""

REMARKS: dict[str, tuple[str, ...]] = {"discovery": (), "lunar-lander": (), "reacher": (), "football": ()}
