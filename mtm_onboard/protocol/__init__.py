"""What robot and auditor share: key, keystream, scheme, waveform, codebook, framing."""

from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key, generate_key, load_key, save_key
from mtm_onboard.protocol.scheme import Channel, Scheme

__all__ = ["Channel", "Codebook", "Key", "MtmError", "Scheme", "generate_key", "load_key", "save_key"]
