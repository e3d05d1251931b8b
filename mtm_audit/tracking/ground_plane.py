"""The plane on which square markers move, and their tracks as a camera straight above it would have shown them.

Seen at an angle, a step far away is shorter in the picture than one nearby, and a step away from the camera shorter
than one across, so that what a robot plays is louder in some places than in others. Markers are squares, and each keeps
its size: under one turn of the camera all of them are squares of one size again. Planes at other heights need the same
turn.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mtm_audit.model.lens import Lens
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.background_path import track_frame
from mtm_audit.tracking.camera_path import moved, moved_track

LEAST_SQUARES, MOST_SQUARES, FIRST_SQUARES = 30, 400, 60
# Squares seen from above must be by so much better squares of one size, and as good as that.
LEAST_BETTER, MOST_MISFIT = 0.5, 0.05
OUTLYING = 0.02  # of a side
STEEPEST = np.tan(np.deg2rad(82.0))
# Of focal lengths by the picture's longer side: what cameras have, and how little is known of it beforehand.
FOCALS, FOCAL_WEIGHT = (0.3, 8.0), 0.01
# From where the search begins: from above, and at an angle on each side.
STARTS = ((0.0, 0.0), (1.2, 0.0), (-1.2, 0.0), (0.0, 1.2), (0.0, -1.2))

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class GroundPlane:
    """`from_above` (3, 3) is the homography, in the frame of the tracks, to a camera straight above the plane.

    Markers keep the size that they have in the picture, on the average. `tilt_rad` is how far the camera looks from
    straight down.
    """

    from_above: Floats
    tilt_rad: float

    def applied(self, track: Track) -> Track:
        """The track as seen from above, headings too; not valid beyond the horizon."""
        return moved_track(track, self._moved)

    def _moved(self, places: Floats) -> Floats:
        ahead = places @ self.from_above[2, :2] + self.from_above[2, 2] > 0.0
        return np.asarray(np.where(ahead[..., None], moved(self.from_above, places), np.nan))


def from_above(
    tracks: Sequence[Track],
    size: tuple[int, int],
    lens: Lens | None = None,
    warn: Callable[[str], None] | None = None,
    *,
    flipped: bool = False,
) -> list[Track]:
    """Tracks as seen from straight above, where they have the corners of markers that tell; their corners are dropped.

    `size` is that of the pictures, mirrored when `flipped`; `lens` is what they were straightened by. Others stay as
    they are. `warn` is told how far the camera looked from straight down.
    """
    plane = ground_plane(tracks, size, lens, flipped=flipped)
    if plane is not None:
        if warn is not None:
            warn(
                f"the camera looked {np.rad2deg(plane.tilt_rad):.0f} degrees away from straight down, by the shapes of "
                "the markers; tracks are as seen from above"
            )
        tracks = [plane.applied(track) for track in tracks]
    return [track if track.corners is None else replace(track, corners=None) for track in tracks]


def ground_plane(
    tracks: Sequence[Track], size: tuple[int, int], lens: Lens | None = None, *, flipped: bool = False
) -> GroundPlane | None:
    """The plane of the tracks' markers; None where they are too few, or seen from above, or on no one plane."""
    squares, owners = _squares(tracks)
    if len(squares) < LEAST_SQUARES:
        return None
    view = _View.of(size, lens, flipped=flipped)
    rough = slice(None, None, max(1, len(squares) // FIRST_SQUARES))
    few = [_fitted(view, squares[rough], owners[rough], np.array([*start, 0.0])) for start in STARTS]
    found, misfit = _fitted(view, squares, owners, min(few, key=lambda fit: fit[1])[0])
    flat = _robust_rms(_misfits(view, np.zeros(3), squares, owners))
    if misfit > min(MOST_MISFIT, LEAST_BETTER * flat):
        return None
    turned = view.from_above(found)
    before, after = (np.log(np.abs(_sides(places))) for places in (squares, moved(turned, squares)))
    scale = float(np.exp(np.mean(before - after)))
    middle = squares.mean(axis=(0, 1))
    shift = middle - scale * moved(turned, squares).mean(axis=(0, 1))
    centred = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]], [0.0, 0.0, 1.0]]) @ turned
    # Positive where the markers are, so that the horizon is where it is zero.
    signed = centred * np.sign(centred[2, :2] @ middle + centred[2, 2])
    return GroundPlane(signed, float(np.arctan(np.hypot(*found[:2]))))


@dataclass(frozen=True)
class _View:
    """A pinhole camera in the frame of the tracks; `focal_px` is known of a lens, else the picture's longer side."""

    focal_px: Floats
    centre_px: Floats
    is_known: bool

    @classmethod
    def of(cls, size: tuple[int, int], lens: Lens | None, *, flipped: bool) -> "_View":
        if lens is None:
            return cls(np.full(2, float(max(size))), (np.array(size) - 1.0) / 2.0, False)
        centre = moved(track_frame(size, flipped), np.array(lens.centre_px))
        return cls(np.array(lens.focal_px), centre, True)

    def from_above(self, tilt: Floats) -> Floats:
        """The homography (3, 3) of the turn that makes the plane's normal the direction of view.

        `tilt` are the normal's slopes against that direction, across and up, and the logarithm of the focal length by
        the one that is supposed, which counts where that is not known.
        """
        across, up = self.focal_px * (1.0 if self.is_known else np.exp(tilt[2]))
        matrix = np.array([[across, 0.0, self.centre_px[0]], [0.0, up, self.centre_px[1]], [0.0, 0.0, 1.0]])
        normal = np.array([tilt[0], tilt[1], 1.0]) / np.sqrt(1.0 + tilt[0] ** 2 + tilt[1] ** 2)
        # The shortest turn of one direction into another (Rodrigues).
        lean = np.array([[0.0, 0.0, -normal[0]], [0.0, 0.0, -normal[1]], [normal[0], normal[1], 0.0]])
        turn = np.eye(3) + lean + lean @ lean / (1.0 + normal[2])
        return np.asarray(matrix @ turn @ np.linalg.inv(matrix))


def _squares(tracks: Sequence[Track]) -> tuple[Floats, NDArray[np.intp]]:
    """Corners (n, 4, 2) of up to MOST_SQUARES markers, spread over tracks and time, and whose they are (n,)."""
    found, owners = [], []
    for number, track in enumerate(tracks):
        if track.corners is not None:
            seen = track.corners[np.isfinite(track.corners).all(axis=(1, 2)) & track.valid]
            found.append(seen)
            owners.append(np.full(len(seen), number))
    if not found:
        return np.empty((0, 4, 2)), np.empty(0, np.intp)
    squares, whose = np.concatenate(found), np.concatenate(owners)
    some = np.linspace(0, len(squares) - 1, min(len(squares), MOST_SQUARES)).astype(np.intp)
    return squares[some], whose[some]


def _fitted(view: _View, squares: Floats, owners: NDArray[np.intp], start: Floats) -> tuple[Floats, float]:
    """The tilt under which the squares are squares of one size, each owner's, and how well they are."""
    low, high = np.log(FOCALS)

    def misfits(tilt: Floats) -> Floats:
        return np.append(_misfits(view, tilt, squares, owners), FOCAL_WEIGHT * tilt[2])

    fit = least_squares(
        misfits,
        start,
        bounds=([-STEEPEST, -STEEPEST, low], [STEEPEST, STEEPEST, high]),
        loss="soft_l1",
        f_scale=OUTLYING,
        max_nfev=60,
    )
    return fit.x, _robust_rms(_misfits(view, fit.x, squares, owners))


def _misfits(view: _View, tilt: Floats, squares: Floats, owners: NDArray[np.intp]) -> Floats:
    """How far each is from a square, in four directions, and from its owner's mean size, as parts of a side: (5 n,)."""
    turned = view.from_above(tilt)
    depths = squares @ turned[2, :2] + turned[2, 2]
    if np.any(depths < 1e-6):
        return np.ones(5 * len(squares))  # beyond the horizon there is no floor
    corners = moved(turned, squares) @ np.array([1.0, 1j])
    sides = _sides(moved(turned, squares))
    # Of the discrete Fourier transform of four corners a square has one part alone.
    sheared, crossed = corners @ np.array([1.0, 1j, -1.0, -1j]), corners @ np.array([1.0, -1j, -1.0, 1j])
    others = np.where(np.abs(sheared) < np.abs(crossed), sheared, crossed) / 4.0 / sides
    uneven = corners @ np.array([1.0, -1.0, 1.0, -1.0]) / 4.0 / sides
    sizes = np.log(np.abs(sides))
    means = np.bincount(owners, sizes) / np.maximum(np.bincount(owners), 1)
    return np.concatenate([others.real, others.imag, uneven.real, uneven.imag, sizes - means[owners]])


def _sides(squares: Floats) -> Complexes:
    """Half a diagonal of each square (n, 4, 2) as a complex number, whichever way round its corners go."""
    corners = squares @ np.array([1.0, 1j])
    one, other = corners @ np.array([1.0, 1j, -1.0, -1j]), corners @ np.array([1.0, -1j, -1.0, 1j])
    return np.asarray(np.where(np.abs(one) >= np.abs(other), one, other) / 4.0)


def _robust_rms(misfits: Floats) -> float:
    """The root mean square, in which what is far out counts as the loss of the fit has it."""
    return float(OUTLYING * np.sqrt(np.mean(2.0 * (np.sqrt(1.0 + (misfits / OUTLYING) ** 2) - 1.0))))
