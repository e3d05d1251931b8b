"""From three dimensions to the floor: horizontal positions, and headings of bodies."""

from collections.abc import Callable

import numpy as np

from mtm_audit.model.track import Floats

# Two horizontal axes for each axis that points up, so that all three are right-handed.
_HORIZONTAL = {
    "z": ((1, 0, 0), (0, 1, 0)),
    "-z": ((1, 0, 0), (0, -1, 0)),
    "y": ((1, 0, 0), (0, 0, -1)),
    "-y": ((1, 0, 0), (0, 0, 1)),
    "x": ((0, 1, 0), (0, 0, 1)),
    "-x": ((0, 0, 1), (0, 1, 0)),
}
# How far an axis may be from level without pointing any worse: the body's sway turns it by a fifth of the sway at most.
_LEVEL = np.cos(np.deg2rad(12.0))
# An axis nearer to the vertical than this shows no heading: the body's sway turns it anywhere.
_UPRIGHT = np.sin(np.deg2rad(10.0))
# No heading holds for longer while it is not measured.
_FARTHEST_S = 0.5


def horizontal(vectors: Floats, up: str) -> Floats:
    """Horizontal parts, shape (n, 2), of vectors of shape (n, 3) where the axis `up` points away from the floor."""
    # Not a product of matrices, in which a NaN height would spoil the rest.
    columns = [sum(sign * vectors[:, axis] for axis, sign in enumerate(row) if sign) for row in _HORIZONTAL[up]]
    return np.asarray(np.stack(columns, axis=1))


def headings_of_quaternions(quaternions_xyzw: Floats, up: str, axis: str) -> Floats:
    """Headings in radians, shape (n,), counter-clockwise seen from above; NaN where a quaternion is none.

    They are the direction on the floor of the body's `axis`, one of x, y, z, -x, -y and -z.
    """
    side = _sides(quaternions_xyzw, up)["xyz".index(axis[-1])]
    sign = -1.0 if axis.startswith("-") else 1.0
    return np.asarray(np.arctan2(sign * side[:, 1], sign * side[:, 0]))


def heading_axis_of(quaternions_xyzw: Floats, up: str) -> str:
    """The first of the body's axes x, y and z that lies about level, by the median; else the one that lies most level.

    Sensors and cameras are mounted in any way, and an axis that stands says little about where the body looks. Another
    axis than the one that leads puts all headings off by a constant.
    """
    levels = [_levelness(side) for side in _sides(quaternions_xyzw, up)]
    about_level = [axis for axis, level in zip("xyz", levels, strict=True) if level >= _LEVEL]
    return about_level[0] if about_level else "xyz"[int(np.argmax(levels))]


def stands_upright(quaternions_xyzw: Floats, up: str, axis: str) -> bool:
    """Whether the body's `axis` is so near to the vertical, by the median, that it shows no heading."""
    return bool(_levelness(_sides(quaternions_xyzw, up)["xyz".index(axis[-1])]) < _UPRIGHT)


def _sides(quaternions_xyzw: Floats, up: str) -> list[Floats]:
    """The horizontal parts (n, 2) of the body's three axes."""
    matrices = matrices_of_quaternions(quaternions_xyzw)
    return [horizontal(matrices[:, :, axis], up) for axis in range(3)]


def _levelness(side: Floats) -> float:
    """The median length of an axis on the floor: 1 lies level, 0 stands upright; 0 where nothing is known."""
    lengths = np.hypot(side[:, 0], side[:, 1])
    known = lengths[np.isfinite(lengths)]
    return float(np.median(known)) if len(known) else 0.0


def matrices_of_quaternions(quaternions_xyzw: Floats) -> Floats:
    """Rotation matrices, shape (n, 3, 3), of quaternions of any length; NaN where one has none."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        # Largest part first: squares of what a file may hold overflow.
        scaled = quaternions_xyzw / np.max(np.abs(quaternions_xyzw), axis=1, keepdims=True)
        x, y, z, w = (scaled / np.linalg.norm(scaled, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def quaternions_of_euler(angles_rad: Floats, order: str) -> Floats:
    """Quaternions x, y, z, w, shape (n, 4), of angles (n, 3) about the axes of `order` (scipy's convention)."""
    from scipy.spatial.transform import Rotation

    return _where_known(angles_rad, lambda known: Rotation.from_euler(order, known).as_quat())


def quaternions_of_rotation_vectors(vectors_rad: Floats) -> Floats:
    """Quaternions x, y, z, w, shape (n, 4), of rotation vectors (n, 3)."""
    from scipy.spatial.transform import Rotation

    return _where_known(vectors_rad, lambda known: Rotation.from_rotvec(known).as_quat())


def quaternions_of_matrices(matrices: Floats) -> Floats:
    """Quaternions x, y, z, w, shape (n, 4), of rotation matrices (n, 3, 3); NaN where a matrix is no rotation."""
    from scipy.spatial.transform import Rotation

    with np.errstate(over="ignore", invalid="ignore"):
        turning = np.linalg.det(np.where(np.isfinite(matrices), matrices, 0.0)) > 0.5
    flat = np.where(turning[:, None], matrices.reshape(-1, 9), np.nan)
    return _where_known(flat, lambda known: Rotation.from_matrix(known.reshape(-1, 3, 3)).as_quat())


def _where_known(rows: Floats, convert: Callable[[Floats], Floats]) -> Floats:
    quaternions = np.full((len(rows), 4), np.nan)
    known = np.all(np.isfinite(rows) & (np.abs(rows) < 1e6), axis=1)
    if known.any():
        quaternions[known] = convert(rows[known])
    return quaternions


def headings_at(times_s: Floats, known_s: Floats, headings_rad: Floats) -> Floats:
    """Headings at `times_s`, shape (n,), between those at `known_s`; NaN farther than half a second from any."""
    known = np.isfinite(headings_rad) & np.isfinite(known_s)
    known_s, headings_rad = known_s[known], headings_rad[known]
    if not len(known_s):
        return np.full(len(times_s), np.nan)
    order = np.argsort(known_s, kind="stable")
    known_s, headings_rad = known_s[order], headings_rad[order]
    found = np.interp(times_s, known_s, np.unwrap(headings_rad))
    after = np.clip(np.searchsorted(known_s, times_s), 1, len(known_s) - 1) if len(known_s) > 1 else np.zeros(1, int)
    nearest_s = np.minimum(np.abs(known_s[after] - times_s), np.abs(known_s[np.maximum(after - 1, 0)] - times_s))
    return np.asarray(np.where(nearest_s <= _FARTHEST_S, found, np.nan))
