"""Trees of transforms (tf): how one frame moves in another, through whatever is between them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.orientation import matrices_of_quaternions, quaternions_of_matrices
from mtm_audit.readers.logs.pose_messages import Samples
from mtm_onboard.protocol.errors import MtmError

Edge = tuple[str, str]


@dataclass(frozen=True)
class Moving:
    """Poses (n, 4, 4) of a frame at `times_s` (n,); one pose without a time holds always."""

    times_s: Floats
    matrices: Floats

    @property
    def fixed(self) -> bool:
        """Whether the pose is one that holds always."""
        return len(self.matrices) == 1


def moving_of(samples: Samples, *, arrival: bool) -> Moving:
    """The transform of an edge, sorted by time; of equal times the first."""
    times_s, first = np.unique(samples.times_s(arrival=arrival), return_index=True)
    quaternions = samples.quaternions_xyzw()
    matrices = np.tile(np.eye(4), (len(first), 1, 1))
    if quaternions is not None:
        matrices[:, :3, :3] = matrices_of_quaternions(quaternions[first])
    matrices[:, :3, 3] = samples.positions()[first]
    return Moving(times_s, matrices)


def between(edges: Mapping[Edge, Moving], parent: str, child: str) -> Moving:
    """How `child` moves in `parent`, at the times of whichever transform on the way comes most often.

    The others are interpolated there, and are NaN before their first and after their last. Raises MtmError when there
    is no way, or nothing on it moves.
    """
    up_from_child, up_from_parent = _chain(edges, child), _chain(edges, parent)
    common = next((frame for frame in [child, *(edge[0] for edge in up_from_child)]
                   if frame in [parent, *(edge[0] for edge in up_from_parent)]), None)  # fmt: skip
    if common is None:
        raise MtmError(f"no transforms lead from {parent} to {child}; the frames are: {', '.join(_frames(edges))}")
    down = _until(up_from_child, common)
    back = _until(up_from_parent, common)
    moving = [edges[edge] for edge in (*down, *back) if not edges[edge].fixed]
    if not moving:
        raise MtmError(f"{child} does not move in {parent}; name two frames between which something moves")
    times_s = max(moving, key=lambda item: len(item.times_s)).times_s
    whole = np.tile(np.eye(4), (len(times_s), 1, 1))
    for edge in down:
        whole = _at(edges[edge], times_s) @ whole
    to_parent = np.tile(np.eye(4), (len(times_s), 1, 1))
    for edge in back:
        to_parent = _at(edges[edge], times_s) @ to_parent
    return Moving(times_s, _inverse(to_parent) @ whole)


def pairs(edges: Mapping[Edge, Moving]) -> list[Edge]:
    """The edges that move, which are what a choice is offered of."""
    return sorted(edge for edge, moving in edges.items() if not moving.fixed)


def _frames(edges: Mapping[Edge, Moving]) -> list[str]:
    return sorted({frame for edge in edges for frame in edge})[:40]


def _chain(edges: Mapping[Edge, Moving], frame: str) -> list[Edge]:
    """The edges from a frame to its root; a frame that is in a circle ends it."""
    by_child = {edge[1]: edge for edge in edges}
    chain: list[Edge] = []
    while frame in by_child and by_child[frame] not in chain:
        chain.append(by_child[frame])
        frame = chain[-1][0]
    return chain


def _until(chain: list[Edge], frame: str) -> list[Edge]:
    ends = [index for index, edge in enumerate(chain) if edge[0] == frame]
    return chain[: ends[0] + 1] if ends else []


def _at(moving: Moving, times_s: Floats) -> Floats:
    """Matrices (n, 4, 4) at other times: positions along lines, turns along great circles."""
    if moving.fixed or np.array_equal(times_s, moving.times_s):
        return moving.matrices
    from scipy.spatial.transform import Rotation, Slerp

    good = np.all(np.isfinite(moving.matrices), axis=(1, 2))
    found = np.full((len(times_s), 4, 4), np.nan)
    if good.sum() < 2:
        return found
    known_s, known = moving.times_s[good], moving.matrices[good]
    inside = (times_s >= known_s[0]) & (times_s <= known_s[-1])
    if not inside.any():
        return found
    turns = Slerp(known_s, Rotation.from_quat(quaternions_of_matrices(known[:, :3, :3])))
    found[inside] = np.eye(4)
    found[inside, :3, :3] = turns(times_s[inside]).as_matrix()
    for axis in range(3):
        found[inside, axis, 3] = np.interp(times_s[inside], known_s, known[:, axis, 3])
    return found


def _inverse(matrices: Floats) -> Floats:
    turned = np.swapaxes(matrices[:, :3, :3], 1, 2)
    inverse = np.tile(np.eye(4), (len(matrices), 1, 1))
    inverse[:, :3, :3] = turned
    inverse[:, :3, 3] = -np.einsum("nij,nj->ni", turned, matrices[:, :3, 3])
    return inverse
