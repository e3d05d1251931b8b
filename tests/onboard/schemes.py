"""Small schemes for the tests of what runs on the robot."""

from mtm_onboard.protocol import Channel, Codebook, Scheme

FAKE_SECRET = b"not a real secret, only for test"


def small_scheme(**changes) -> Scheme:
    """Two channels: "a" plays one symbol on vx and vy, "b" three symbols on wz; 120 ticks at 50 Hz."""
    plain = dict(
        name="test", rate_hz=50.0, band_hz=(2.0, 20.0), alphabet_size=4, message_ticks=120,
        channels=(Channel("a", "a", ("vx", "vy"), 1, 0.1), Channel("b", "b", ("wz",), 3, 0.2)),
    )  # fmt: skip
    return Scheme(**(plain | changes))


def small_codebook(first_slot: int = 0, **changes) -> Codebook:
    """The codebook of `small_scheme` under the fake secret."""
    return Codebook(FAKE_SECRET, small_scheme(**changes), first_slot)
