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
# An axis of the body that is steeper than this says little about where it looks; a camera's or an IMU's may stand.
_STEEPEST = np.cos(np.deg2rad(30.0))
# No heading holds for longer while it is not measured.
_FARTHEST_S = 0.5


def horizontal(vectors: Floats, up: str) -> Floats:
    """Horizontal parts, shape (n, 2), of vectors of shape (n, 3) where the axis `up` points away from the floor."""
    # Not a product of matrices, in which a NaN height would spoil the rest.
    columns = [sum(sign * vectors[:, axis] for axis, sign in enumerate(row) if sign) for row in _HORIZONTAL[up]]
    return np.asarray(np.stack(columns, axis=1))


def headings_of_quaternions(quaternions_xyzw: Floats, up: str) -> Floats:
    """Headings in radians, shape (n,), counter-clockwise seen from above; NaN where a quaternion is none.

    They are the direction of the body's x axis on the floor. Where that stands upright all the time, the next axis
    that does not takes its place, and all headings are off by a constant.
    """
    matrices = matrices_of_quaternions(quaternions_xyzw)
    sides = [horizontal(matrices[:, :, axis], up) for axis in range(3)]
    flatness = [_median(np.hypot(side[:, 0], side[:, 1])) for side in sides]
    lying = [axis for axis in range(3) if flatness[axis] > np.sqrt(1.0 - _STEEPEST**2)]
    side = sides[lying[0] if lying else 0]
    return np.arctan2(side[:, 1], side[:, 0])


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


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0


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
