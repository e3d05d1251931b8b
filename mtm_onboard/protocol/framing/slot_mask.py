"""The slot's mask on frames of version 2: a frame holds in the slot for which it was written, and in no other.

Reed-Solomon codes are linear: the codeword of data with a tag, and the slot's pad added to the tag, is the codeword of
the data plus that of the pad. So a receiver takes the mask off each slot's symbols before it adds repeats up, although
it does not know the message yet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.framing.code import encode_symbols
from mtm_onboard.protocol.framing.framing import layout_of
from mtm_onboard.protocol.slots import epoch_of_slot

if TYPE_CHECKING:
    from mtm_onboard.protocol.holding import Holding
    from mtm_onboard.protocol.scheme import Scheme


def slot_mask(scheme: Scheme, holding: Holding, slot: int) -> NDArray[np.int64] | None:
    """What is added (exclusive or) to the symbols of a frame in frame order, shape (L,); None where nothing is.

    Only frames of version 2 with a tag have one.
    """
    framing = scheme.framing
    if framing is None or framing.check != "tag" or scheme.schedule == "fixed" or holding.grant is None:
        return None
    epoch, in_epoch = epoch_of_slot(slot, scheme)
    pad = holding.tag_key(epoch).slot_pad(epoch, in_epoch, framing.check_bits)
    layout = layout_of(framing, scheme.alphabet_size, scheme.message_symbols)
    return np.array(encode_symbols([pad], layout)[0], dtype=np.int64)
