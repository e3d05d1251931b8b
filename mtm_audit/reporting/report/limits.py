"""What a verdict says to a reader who was not there, and what none proves."""

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.reporting.delivery import frame_sentences

_OF_A_FILE = (
    "The verdict is about the motion in the files whose hashes are below. It does not say who filmed it, where, or "
    "whether the file was cut or staged."
)
_OF_A_KEY = "It says that the motion was made with this key, and not who held the key."
_BY_VERDICT = {
    "decoded": (_OF_A_KEY, _OF_A_FILE),
    "inconclusive": (
        "What the message says is not established: what is not certain must not be quoted as read.",
        _OF_A_KEY,
        _OF_A_FILE,
    ),
    "absent": (
        "It says that this recording does not show a message of this key, and not that none was sent.",
        _OF_A_FILE,
    ),
}


def shown(decoding: Decoding, authenticates: bool) -> tuple[str, ...]:
    """What is shown: that a message is there, and what a frame's check proves of it; nothing without a message."""
    if decoding.verdict == "absent":
        return ()
    present = f"A message of key {decoding.key_id} is in the motion that was recorded."
    return (present, *frame_sentences(decoding, authenticates=authenticates))


def limits(decoding: Decoding) -> tuple[str, ...]:
    """What is not shown, by the verdict."""
    return _BY_VERDICT[decoding.verdict]
