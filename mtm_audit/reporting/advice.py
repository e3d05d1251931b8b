"""What would help when a recording did not say everything."""

import math

from mtm_audit.decoding.decode import MORE_DECOYS, NEARLY
from mtm_audit.decoding.decoding import CERTAIN, Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.film_limits import film_limits
from mtm_onboard.protocol.framing import payload_bits

_LONGEST_FACTOR = 10.0


def advice(recording: Recording, decoding: Decoding) -> tuple[str, ...]:
    """Sentences for a decode that is not "decoded": what is uncertain and what to try; nothing otherwise."""
    if decoding.verdict == "decoded":
        return ()
    return (*_of_the_verdict(recording, decoding), *film_limits(recording, decoding.scheme))


def _of_the_verdict(recording: Recording, decoding: Decoding) -> tuple[str, ...]:
    if decoding.verdict == "absent":
        return (
            "either nobody sent a message, or it was sent with another key, or the recording is too short or too "
            "coarse to show it",
            *_of_the_nearly_found(decoding),
            *_of_the_speed(recording),
        )
    if decoding.scheme.framing is not None:
        return (_of_the_frame(decoding),)
    if not decoding.uncertain and not decoding.order_known:
        return (
            "the message repeats, and nothing shows which of its symbols comes first; give --onset when it is known "
            "when the robot began, or send with a key whose schedule is rolling",
        )
    if not decoding.uncertain:
        spelled = ", ".join(str(symbol) for symbol in decoding.symbols)
        return (
            f"the symbols {spelled} are certain, but they spell none of the numbers 0 to "
            f"{(1 << payload_bits(decoding.scheme)) - 1}; the robot was perhaps given symbols instead of a number",
        )
    return tuple(_of_the_uncertain(recording, decoding))


def _of_the_speed(recording: Recording) -> tuple[str, ...]:
    """A film does not show by itself that it was slowed down."""
    if recording.kind != "video" or recording.speed_searched or recording.speed != 1.0:
        return ()
    return (
        "slow motion, time lapse and a wrong frame rate look like this too: give --speed or --frame-rate when they are "
        "known, or let --search-speed try common ones",
    )


def _of_the_nearly_found(decoding: Decoding) -> tuple[str, ...]:
    """Evidence near the limit is no reason to take a message for absent."""
    evidence = decoding.evidence
    if evidence.p_value > NEARLY:
        return ()
    if evidence.nats is not None or evidence.decoys is None:
        return (
            f"a recording without a message shows as much in {evidence.p_value:.2g} of cases at most, so do not "
            "take it for absent before a longer recording has said so too",
        )
    # A tail known from few decoys is taken for heavy, so that more of them may show the same evidence to be rare.
    decoys = MORE_DECOYS * len(evidence.decoys.decoy_strengths)
    return (
        f"chance seldom comes so near: do not take it for absent before more decoy keys (--decoys {decoys}) or a "
        "longer recording have said so too",
    )


def _of_the_frame(decoding: Decoding) -> str:
    unseen = sum(symbol is None for symbol in decoding.symbols)
    doubtful = len(decoding.uncertain) - unseen
    seen = f"{unseen} of {len(decoding.symbols)} symbols were not seen and {doubtful} are less than {CERTAIN:.0%} sure"
    when = "; check --at as well: a frame's check holds in its own day alone" if decoding.settings.at else ""
    return f"what was read is no frame of this key whose check holds: {seen}; record more repetitions of it{when}"


def _of_the_uncertain(recording: Recording, decoding: Decoding) -> list[str]:
    sentences = []
    unseen = [place for place in decoding.uncertain if decoding.symbols[place] is None]
    silent = [place for place in decoding.uncertain if place not in unseen and _is_silent(decoding, place)]
    doubtful = [place for place in decoding.uncertain if place not in unseen and place not in silent]
    if unseen:
        bodies = sorted({body for place in unseen for body in _bodies(decoding, place)})
        sentences.append(
            f"not seen: {_places(unseen)}, the part of {_listed(bodies)}; record that robot too, or name its track "
            "with --assign"
        )
    if silent:
        bodies = sorted({body for place in silent for body in _bodies(decoding, place)})
        sentences.append(
            f"{_listed(bodies)} does not show its channel, so {_places(silent)} cannot be read; check that it sends, "
            "that it is in sight, and that its track is the right one"
        )
    if doubtful:
        bodies = sorted({body for place in doubtful for body in _bodies(decoding, place)})
        what = f"{_places(doubtful)}, the part of {_listed(bodies)}"
        sentences.append(f"uncertain: {what}; {_longer(recording, decoding, doubtful)}")
    return sentences


def _is_silent(decoding: Decoding, place: int) -> bool:
    """Whether every channel that sends the symbol was seen and says nothing."""
    bodies = _bodies(decoding, place)
    states = [channel.state for channel in decoding.channels if channel.channel.body in bodies]
    return all(state == "silent" for state in states)


def _longer(recording: Recording, decoding: Decoding, doubtful: list[int]) -> str:
    """How much recording would settle it: evidence grows in proportion to the number of repeats."""
    factor = max(_missing(decoding, place) for place in doubtful)
    message_s = decoding.scheme.message_ticks / decoding.scheme.rate_hz
    if factor > _LONGEST_FACTOR:
        return (
            f"even {_LONGEST_FACTOR:g} times this recording would hardly settle it; come closer, or check that the "
            "robot plays the message"
        )
    wanted_s = math.ceil(max(recording.duration_s, message_s) * factor / message_s) * message_s
    wanted_s = max(wanted_s, (math.floor(recording.duration_s / message_s) + 1) * message_s)
    return f"a recording of roughly {wanted_s:.0f} s in which the message repeats should settle it"


def _missing(decoding: Decoding, place: int) -> float:
    """How many times the evidence of a symbol would suffice."""
    nats = decoding.symbol_nats[place]
    if nats is not None:
        return decoding.needed_nats / max(nats, 0.01 * decoding.needed_nats)
    needed = math.log(CERTAIN / (1.0 - CERTAIN))
    return needed / max(_log_odds(decoding, place), needed / 100.0)


def _log_odds(decoding: Decoding, place: int) -> float:
    """Of the best symbol against all others."""
    posterior = float(decoding.posteriors[place].max())
    return math.log(max(posterior, 1e-12) / max(1.0 - posterior, 1e-12))


def _bodies(decoding: Decoding, place: int) -> list[str]:
    scheme = decoding.scheme
    if scheme.combine == "same":
        return [channel.body for channel in scheme.channels]
    owners = [channel.body for channel in scheme.channels for _ in range(channel.symbols)]
    return [owners[place]]


def _places(places: list[int]) -> str:
    return ("symbol " if len(places) == 1 else "symbols ") + _listed([str(place) for place in places])


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
