"""How coarsely a film is coded, and how small a motion is left in it."""

from dataclasses import dataclass

# From `mtm-hil codecs motion` (results/codecs_motion.csv): where the tracked motion of a sharp marker of 60 pixels
# correlates with the true one by 0.7. H.264 keeps 0.03 px at the quantiser 13 and 0.09 px at 29, whatever encoder wrote
# it; of the others nothing but the number of bits is known, and equal numbers keep different things.
_FINEST_PX = 0.02
_QUANTISER_PX, _AT_QUANTISER, _STEPS_PER_OCTAVE = 0.03, 13.0, 10.0
_USUAL_PX = (0.03, 0.1)
# Every picture stands by itself in these, so that nothing is carried over from the one before.
_SINGLE_PICTURES = frozenset({"dnxhd", "ffv1", "huffyuv", "jpeg2000", "mjpeg", "png", "prores", "rawvideo", "utvideo"})


@dataclass(frozen=True)
class Compression:
    """A film's codec, its bits for each pixel of each picture, and the mean quantiser where H.264 states it."""

    codec: str
    bits_per_pixel: float
    quantiser: float | None = None

    @property
    def smallest_motion_px(self) -> tuple[float, float]:
        """Bounds on the motion of a sharp marker below which it is lost, in pixels root mean square.

        Soft, faint and small things need several times as much.
        """
        if self.quantiser is not None:
            limit_px = _QUANTISER_PX * 2.0 ** ((self.quantiser - _AT_QUANTISER) / _STEPS_PER_OCTAVE)
            return max(limit_px, _FINEST_PX), max(1.5 * limit_px, _FINEST_PX)
        return (_FINEST_PX, _USUAL_PX[0]) if self.codec in _SINGLE_PICTURES else _USUAL_PX
