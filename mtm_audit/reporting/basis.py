"""What a verdict rests on beside its evidence: schedule, kind of key, when a day's key became public, revocations."""

import math
from dataclasses import dataclass
from datetime import UTC, datetime

from mtm_audit.decoding.decoding import Decoding
from mtm_onboard.protocol.holding import Grant
from mtm_onboard.protocol.key import Key

FIXED = (
    "The key's schedule is fixed: an old motion of these robots, or one put together from parts of several, would read "
    "the same."
)
_PUBLIC = "This is the public channel: everybody who has the anchor can read it, and play it as well."


@dataclass(frozen=True)
class Disclosure:
    """Since when the disclosed key, by which a film is verified, may be public, and what says when the film is from.

    `stated` when a person said so, else the file did; `written` is when this copy was last written.
    """

    public_from: datetime
    stated: bool
    written: datetime


@dataclass(frozen=True)
class Basis:
    """Sentences for the report, and whether what is read may be called authenticated when its tag holds."""

    sentences: tuple[str, ...] = ()
    authenticates: bool = True


def basis_of(
    decoding: Decoding, grant: Grant | None, disclosure: Disclosure | None, carried: Key | None = None
) -> Basis:
    """What the verdict of a decoding rests on; nothing without a message.

    `carried` is the disclosed key that the public channel was found to carry.
    """
    if decoding.verdict == "absent":
        return Basis()
    if grant is not None and grant.kind == "public":
        return Basis((_PUBLIC, *_carried(carried)))
    sentences, authenticates = [], True
    if decoding.scheme.schedule == "fixed":
        sentences.append(FIXED)
    elif grant is not None and disclosure is None:
        sentences.append(_holders(grant))
    if disclosure is not None:
        sentence, authenticates = _disclosed(disclosure)
        sentences.append(sentence)
    unheard = _unheard_channels(decoding) if grant is not None else ()
    if unheard and decoding.frames:
        authenticates = False
        sentences.append(
            f"Not authenticated: {', '.join(unheard)} shows nothing of its own, and the code filled in its part, so "
            "who holds the files of the others alone could have made this motion."
        )
    revoked = _revoked_channels(decoding)
    if revoked:
        authenticates = False
        sentences.append(
            f"Not authenticated: the key file of {', '.join(revoked)} was revoked by then, so whoever took it may have "
            "made this motion."
        )
    return Basis(tuple(sentences), authenticates)


def _carried(carried: Key | None) -> tuple[str, ...]:
    grant = None if carried is None else carried.holding.grant
    if grant is None:
        return ()
    return (
        f"It carries the disclosed key of {grant.first_day}: the anchor confirms it, whoever played it. With it "
        "everybody can verify films of that day, and from then on make such motions as well.",
    )


def _holders(grant: Grant) -> str:
    names = ", ".join(grant.channels)
    return (
        f"This motion can be made by who holds a file of its day: the robots of {names}, each its own channel, and "
        "auditors of that day."
    )


def _disclosed(disclosure: Disclosure) -> tuple[str, bool]:
    public = f"{disclosure.public_from:%Y-%m-%d %H:%M} UTC"
    rests = (
        f"Verified by a disclosed key, which may be public since {public}. A film made after that proves nothing: then "
        "everybody could make this motion."
    )
    written = f"{disclosure.written.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
    if disclosure.written < disclosure.public_from:
        return f"{rests} This copy was last written on {written}, before that, by the file system's word.", True
    if disclosure.stated:
        return (
            f"{rests} That the film was made before rests on --at alone: this copy was last written on {written}.",
            True,
        )
    return (
        f"{rests} Nothing but the file's own time says that it was made before, and whoever makes a file can set that; "
        f"this copy was last written on {written}. So it proves nothing by itself.",
        False,
    )


def _unheard_channels(decoding: Decoding) -> tuple[str, ...]:
    """Channels with a part of the message of their own whose motion does not show it; none where all say the same."""
    scheme = decoding.scheme
    if scheme.combine == "same":
        return ()
    needed_nats = math.log(1.0 / decoding.settings.threshold)
    return tuple(item.channel.name for item in decoding.channels if item.nats is None or item.nats < needed_nats)


def _revoked_channels(decoding: Decoding) -> tuple[str, ...]:
    """Channels of the scheme whose robot's file was revoked when the message was sent."""
    at = decoding.settings.at
    when_s = datetime.now(UTC).timestamp() if at is None else at.unix_s + at.error_s
    names = {channel.name for channel in decoding.scheme.channels}
    return tuple(name for name in decoding.settings.revoked.channels(when_s) if name in names)
