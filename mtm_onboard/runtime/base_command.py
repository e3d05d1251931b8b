r"""Base commands as text, one a datagram or line.

    v <vx_mps> <vy_mps> <wz_radps>\n      a body velocity in decimal numbers, for example "v 0.3 0 -0.5"
    stop\n                                the operator's stop: the robot stands still until the runtime is started anew

The newline may be absent in a datagram. A text has 128 bytes at most.
"""

import re

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError

LONGEST_BYTES = 128

_NUMBER = rb"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)"
_VELOCITY = re.compile(rb"v +" + rb" +".join([_NUMBER] * 3))


class StopRequest:
    """The operator said stop."""


def parse(text: bytes) -> BodyVelocity | StopRequest:
    """The command in `text`; raises MtmError when it is malformed, longer than 128 bytes or not finite."""
    if len(text) > LONGEST_BYTES:
        raise MtmError(f"a base command has at most {LONGEST_BYTES} bytes; send shorter numbers")
    line = text.strip()
    if line == b"stop":
        return StopRequest()
    match = _VELOCITY.fullmatch(line)
    velocity = BodyVelocity(*(float(number) for number in match.groups())) if match else None
    if velocity is None or not velocity.is_finite():
        raise MtmError(f"{text!r} is no base command; send 'v <vx_mps> <vy_mps> <wz_radps>' or 'stop'")
    return velocity


def velocity_text(velocity: BodyVelocity) -> bytes:
    """The text of a velocity; `parse` gives back exactly the same. Raises MtmError when it is not finite."""
    if not velocity.is_finite():
        raise MtmError(f"{velocity} is not finite; send finite speeds")
    return b"v %a %a %a\n" % tuple(float(value) for value in velocity)


STOP_TEXT = b"stop\n"
