"""Codewords that algebra finds: generalised minimum distance decoding (Forney) of a Reed-Solomon code."""

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing.code import decode_symbols, encode_symbols
from mtm_onboard.protocol.framing.framing import Layout


def corrected_codewords(ratios: Floats, layout: Layout) -> NDArray[np.int64]:
    """Distinct codewords' channel symbols (codewords, L) near the likeliest symbols, for ratios (L, M).

    The least reliable 0, 2, 4, ... code symbols are left out in turn, as many as there is parity, and the rest decoded
    with as many errors as the code corrects. Empty without a code.
    """
    carrying = layout.code_symbols * layout.group
    best = np.partition(ratios[:carrying], -2, axis=1)[:, -2:]
    # A code symbol is as reliable as the least reliable of its channel symbols.
    reliabilities = (best[:, 1] - best[:, 0]).reshape(layout.code_symbols, layout.group).min(axis=1)
    ranked = np.argsort(reliabilities, kind="stable")
    likeliest = np.argmax(ratios, axis=1).tolist()
    found: dict[int, None] = {}
    for erased in range(0, layout.parity + 1, 2):
        symbols: list[int | None] = list(likeliest)
        for word in ranked[:erased]:
            symbols[word * layout.group : (word + 1) * layout.group] = [None] * layout.group
        try:
            found[decode_symbols(symbols, layout)] = None
        except MtmError:
            continue
    if not layout.parity or not found:
        return np.empty((0, len(ratios)), dtype=np.int64)
    return np.array(encode_symbols(list(found), layout), dtype=np.int64)
