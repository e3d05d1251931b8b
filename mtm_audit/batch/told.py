"""What a recording says under each key, as rows, with what trying several keys costs taken off."""

from collections.abc import Sequence
from dataclasses import dataclass

from mtm_audit.batch.plan import KeyFile, Plan
from mtm_audit.batch.row import UNREADABLE, Row, printable
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.paid import paid_for, worth
from mtm_audit.decoding.recorded import decode_recording
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.basis import basis_of
from mtm_audit.reporting.remarks import remarks
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing import Payload
from mtm_onboard.protocol.key import Key

_BETWEEN = " | "


@dataclass(frozen=True)
class Told:
    """What the recording, at the speed at which it was decoded, says under one key; without them a `refusal`."""

    name: str
    key: Key
    recording: Recording | None = None
    decoding: Decoding | None = None
    refusal: str = ""


def told_under(plan: Plan, file: KeyFile, recording: Recording) -> Told:
    """Decode a recording under one of the plan's keys, which as one of several has to be the surer.

    With n keys each e-value is divided by n, and each p-value multiplied by it, so that "decoded" is wrong at most as
    often as with one, whichever key it is.
    """
    key = file.load()
    try:
        shown, decoding = decode_recording(recording, key, plan.settings, plan.speed)
    except MtmError as error:
        return Told(file.name, key, refusal=str(error))
    return Told(file.name, key, shown, paid_for(decoding, len(plan.keys)))


def rows_of(plan: Plan, name: str, told: Sequence[Told]) -> tuple[Row, ...]:
    """A row for each key that shows a message or a part of one, else a single one: absent, or unreadable under all.

    The row of several absent keys names none of them, and has the most evidence that any shows.
    """
    read = [(item, item.decoding) for item in told if item.decoding is not None]
    refused = [item for item in told if item.decoding is None]
    if not read:
        return (unreadable_row(plan, name, _joined([item.refusal for item in refused])),)
    unread = [f"not read with {item.name}: {item.refusal}" for item in refused]
    shown = [item for item, decoding in read if decoding.verdict != "absent"]
    if shown:
        return tuple(_row(plan, name, item, [*_warnings(item), *unread]) for item in shown)
    best, _ = max(read, key=lambda pair: worth(pair[1]))
    # What holds under one key alone, such as that its robots are not in the picture, says nothing here.
    common = [warning for warning in _warnings(best) if all(warning in _warnings(item) for item, _ in read)]
    return (_row(plan, name, best, [*common, *unread]),)


def unreadable_row(plan: Plan, name: str, error: str) -> Row:
    """The row of a recording that could not be read."""
    return Row(
        path=printable(name),
        verdict=UNREADABLE,
        keys_tried=str(len(plan.keys)),
        error=printable(error),
        run=plan.run,
    )


def _row(plan: Plan, name: str, told: Told, warnings: Sequence[str]) -> Row:
    recording, decoding = told.recording, told.decoding
    assert recording is not None
    assert decoding is not None
    named = decoding.verdict != "absent" or len(plan.keys) == 1
    message, kind = _message(decoding.message)
    return Row(
        path=printable(name),
        verdict=decoding.verdict,
        key=printable(told.name) if named else "",
        key_id=printable(told.key.id) if named else "",
        message=message,
        message_kind=kind,
        authenticated=_authenticated(decoding, told.key),
        bits=f"{decoding.evidence.bits:.2f}",
        chance=f"{decoding.evidence.p_value:.3g}",
        threshold=f"{decoding.settings.threshold:g}",
        keys_tried=str(len(plan.keys)),
        duration_s=f"{recording.duration_s:.3f}",
        warnings=printable(_joined(warnings)),
        run=plan.run,
    )


def _warnings(told: Told) -> tuple[str, ...]:
    if told.recording is None or told.decoding is None:
        return ()
    return remarks(told.recording, told.decoding)


def _message(payload: Payload | None) -> tuple[str, str]:
    """The message as `decode --json` has it, and of which kind it is."""
    if payload is None:
        return "", ""
    if isinstance(payload, bytes):
        return payload.hex(), "bytes"
    return printable(str(payload)), "text" if isinstance(payload, str) else "number"


def _authenticated(decoding: Decoding, key: Key) -> str:
    """Whether the message's tag holds and what the verdict rests on is enough for it; empty without a message."""
    if decoding.message is None or not decoding.frames:
        return ""
    basis = basis_of(decoding, key.holding.grant, None)
    return "yes" if decoding.frames[-1].message.authenticated and basis.authenticates else "no"


def _joined(sentences: Sequence[str]) -> str:
    return _BETWEEN.join(dict.fromkeys(sentences))
