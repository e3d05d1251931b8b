"""Whether a repeated message's first symbol can be told from the others.

Under the fixed schedule every window is played from one set of waveforms, so 3 1 3 1 3 is the message 3 1 or the
message 1 3: only a start that is seen, or given, decides.
"""

import numpy as np

from mtm_audit.detectors.base import Reading
from mtm_onboard.protocol.scheme import Channel, Schedule


def order_is_known(reading: Reading, channel: Channel, schedule: Schedule) -> bool:
    """False when windows beside the found message carry its repeats, so that any rotation fits as well.

    `reading` is one whose onset was searched for. A window carries a repeat when the score of the symbol due in it
    is nearer to that of the message's own windows than to that of symbols not sent.
    """
    symbols = np.argmax(reading.scores, axis=1)
    if schedule == "rolling" or len(set(symbols.tolist())) == 1:
        return True
    due = reading.window_scores[np.arange(len(reading.window_scores)), symbols[reading.window_positions]]
    message_s = reading.window_starts_s - reading.timing.onset_s
    length_s = channel.symbols * float(np.diff(reading.window_starts_s).mean()) if len(due) > 1 else np.inf
    # Half a window of slack: starts are sums of decimal fractions.
    slack_s = 0.5 * length_s / channel.symbols
    own = (message_s > -slack_s) & (message_s < length_s - slack_s)
    if own.all():
        return True
    sent = float(due[own].mean())
    quiet = float(np.delete(reading.scores, symbols + np.arange(len(symbols)) * reading.scores.shape[1]).mean())
    return not bool(np.any(due[~own] > (sent + quiet) / 2.0))
