"""From log-likelihood ratios of symbols to a framed message."""

from mtm_audit.decoding.message.message import Message, decode_message

__all__ = ["Message", "decode_message"]
