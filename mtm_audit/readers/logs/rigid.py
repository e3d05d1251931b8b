"""Markers into rigid bodies: which belong together, and the pose of each body in each frame."""

import re
from collections.abc import Mapping

import numpy as np

from mtm_audit.model.track import Bools, Floats
from mtm_audit.readers.logs.body import Body, Warn
from mtm_audit.readers.logs.orientation import quaternions_of_matrices
from mtm_onboard.protocol.errors import MtmError

# Markers of one body keep their distances to a few millimetres; those of a leg do not.
_MOST_BENT_M = 0.01
_MARKER_NAME = re.compile(r"(.+?)[\s_:-]*(?:marker|mkr|m)?[\s_-]*\d+", re.IGNORECASE)


def grouped(labels: list[str], chosen: Mapping[str, tuple[str, ...]], where: str) -> dict[str, list[int]]:
    """Numbers of the markers of each body, by its name.

    `chosen` names them; else what stands before a colon, or before a number at the end (Rover_Marker1), is the body.
    Raises MtmError when a chosen marker does not exist.
    """
    if chosen:
        for name in (name for names in chosen.values() for name in names if name not in labels):
            raise MtmError(f"{where} has no marker {name!r}; it has: {', '.join(labels[:40])}")
        return {body: [labels.index(name) for name in names] for body, names in chosen.items()}
    groups: dict[str, list[int]] = {}
    for index, label in enumerate(labels):
        groups.setdefault(_body_name(label), []).append(index)
    return groups


def rigid_body(name: str, times_s: Floats, markers_m: Floats, up: str, where: str, warn: Warn) -> Body:
    """The body of markers (n, markers, 3), NaN where unseen: its centre, and its turn since the middle frame.

    Three markers that are seen give the pose of all, so that the centre does not jump when one is hidden; of fewer
    markers the mean of all is taken and there is no heading. `warn` is told when they do not keep their distances.
    """
    seen = np.all(np.isfinite(markers_m), axis=2)
    if markers_m.shape[1] < 3 or not np.any(seen.all(axis=1)):
        return Body(name, times_s, np.mean(markers_m, axis=1), up=up)
    whole = np.flatnonzero(seen.all(axis=1))
    shape = markers_m[whole[len(whole) // 2]]
    centre = shape.mean(axis=0)
    positions_m, matrices, bent_m = _fitted(markers_m, seen, shape - centre)
    if bent_m > _MOST_BENT_M:
        warn(f"{where}: the markers of {name} move against each other, so they are no rigid body; their mean is used")
        return Body(name, times_s, np.mean(markers_m, axis=1), up=up)
    return Body(name, times_s, positions_m, quaternions_xyzw=quaternions_of_matrices(matrices), up=up)


def _fitted(markers_m: Floats, seen: Bools, shape_m: Floats) -> tuple[Floats, Floats, float]:
    """Centres (n, 3), rotations (n, 3, 3) from `shape_m`, and the median misfit, by least squares (Kabsch)."""
    enough = seen.sum(axis=1) >= 3
    weights = (seen & enough[:, None]).astype(float)
    counts = np.maximum(weights.sum(axis=1), 1.0)[:, None]
    placed = np.where(seen[:, :, None], markers_m, 0.0)
    mean = np.einsum("nm,nmi->ni", weights, placed) / counts
    shape_mean = weights @ shape_m / counts
    here = (placed - mean[:, None]) * weights[:, :, None]
    there = (shape_m[None] - shape_mean[:, None]) * weights[:, :, None]
    u, _, vt = np.linalg.svd(np.einsum("nmi,nmj->nij", here, there))
    flip = np.ones((len(u), 3))
    flip[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    turns = np.einsum("nij,nj,njk->nik", u, flip, vt)
    misfit_m = np.linalg.norm(here - np.einsum("nij,nmj->nmi", turns, there), axis=2).max(axis=1)
    centres = mean - np.einsum("nij,nj->ni", turns, shape_mean)
    centres[~enough], turns[~enough] = np.nan, np.nan
    return centres, turns, float(np.median(misfit_m[enough])) if enough.any() else 0.0


def _body_name(label: str) -> str:
    subject, colon, _ = label.partition(":")
    if colon and subject:
        return subject
    found = _MARKER_NAME.fullmatch(label)
    return found[1] if found else label
