"""Whether a RoboMaster on a CAN bus is there and obeys, judged by what it and the CAN adapter have said."""

import math
from typing import Final

from mtm_onboard.links.duml import Message
from mtm_onboard.links.robomaster_messages import WORK_MODE

ANSWER_WITHIN_S: Final = 1.0
ASK_AGAIN_S: Final = 0.1
# A dozen pushes of telemetry at 50 Hz.
QUIET_S: Final = 0.25
LOST_S: Final = 1.0
# A tenth of a second's heartbeats and commands.
MOST_REJECTED_IN_A_ROW: Final = 50
_REJECTIONS_APART_S = 0.5


class Presence:
    """What a robot has shown of itself since `begin`.

    `work_mode` is "unanswered", "acknowledged" or "refused". `heard_s` is when the robot last said anything that was
    sound, on the clock of the calls' `now_s`, and `pushed_s` when it last pushed telemetry; both are -inf before that.
    """

    def __init__(self) -> None:
        self.begin(-math.inf)

    def begin(self, now_s: float) -> None:
        """Judge anew from now on: the link was just opened."""
        self.work_mode = "unanswered"
        self.heard_s = self.pushed_s = -math.inf
        self._begun_s = now_s
        self._asked: set[int] = set()
        self._refusal = b""
        self._adapter = (0, 0)
        self._rejected_in_a_row = 0
        self._rejected_s = -math.inf

    def asked(self, sequence: int) -> None:
        """The work mode was asked for in the message of this number."""
        self._asked.add(sequence)

    def hear(self, now_s: float) -> None:
        """The robot has said something."""
        self.heard_s = now_s

    def take_push(self, now_s: float) -> None:
        """The robot has pushed telemetry."""
        self.pushed_s = now_s

    def take_answer(self, answer: Message) -> None:
        """The robot has answered a request."""
        if WORK_MODE.matches(answer) and answer.sequence in self._asked:
            code = answer.payload[:1]
            self.work_mode = "acknowledged" if code == b"\x00" else "refused"
            self._refusal = code

    def take_adapter(self, rejected: int, taken: int, now_s: float) -> None:
        """How many frames the adapter has rejected, and taken, since it was opened."""
        before_rejected, before_taken = self._adapter
        self._adapter = rejected, taken
        if taken > before_taken or now_s - self._rejected_s > _REJECTIONS_APART_S:
            self._rejected_in_a_row = 0
        if rejected > before_rejected:
            self._rejected_in_a_row += rejected - before_rejected
            self._rejected_s = now_s

    def silent_s(self, now_s: float) -> float:
        """How long the robot has said nothing."""
        return now_s - max(self.heard_s, self._begun_s)

    def fault(self, now_s: float) -> str:
        """Why the robot cannot be taken to obey, in a sentence; empty when it can."""
        rejected, _ = self._adapter
        if self.work_mode == "refused":
            code = f"0x{self._refusal.hex()}" if self._refusal else "no code"
            return f"The robot refused its work mode ({code}); switch it off and on, and end what else drives it."
        if self._rejected_in_a_row >= MOST_REJECTED_IN_A_ROW:
            return (
                f"The CAN adapter rejects every frame ({rejected} so far); check the bit rate, the wiring and that the "
                "robot is on."
            )
        return self.absence(now_s) if self.silent_s(now_s) > LOST_S else ""

    def absence(self, now_s: float) -> str:
        """That the robot says nothing, in a sentence."""
        rejected, _ = self._adapter
        adapter = f", and the CAN adapter rejected {rejected} frames" if rejected else ""
        return (
            f"Nothing has come from the robot for {self.silent_s(now_s):.1f} s{adapter}; check that it is on, the "
            "wiring and the bit rate."
        )

    def doubt(self, now_s: float) -> str:
        """Why the robot may not obey, in words that stay the same while that is so; empty when it seems to."""
        if now_s - self._rejected_s <= _REJECTIONS_APART_S:
            return "the CAN adapter rejects frames"
        if self.work_mode != "acknowledged":
            return "the robot has not acknowledged its work mode"
        if now_s - max(self.pushed_s, self._begun_s) > QUIET_S:
            return "the robot sends no telemetry"
        return ""
