"""The encoders and qualities under which the same film is compared."""

from dataclasses import dataclass

from hil.sensors.encoding import Encoding
from hil.sensors.film_qualities import FILM_QUALITIES, FilmQuality

# What a copy is made from: every picture as the camera took it, but for the halving of its colours.
LOSSLESS = FilmQuality(encoding=Encoding(options={"qp": "0", "preset": "ultrafast"}))


@dataclass(frozen=True)
class Coding:
    """An encoder at one quality, by the names that the table gives them."""

    codec: str
    quality: str
    film: FilmQuality

    @property
    def name(self) -> str:
        """Both names, which no other coding has."""
        return f"{self.codec} {self.quality}"


def _x264(crf: int) -> Coding:
    return Coding(
        "H.264", f"CRF {crf}", FilmQuality(encoding=Encoding(options={"crf": str(crf), "preset": "veryfast"}))
    )


def _x265(crf: int) -> Coding:
    options = {"preset": "superfast", "x265-params": f"log-level=none:crf={crf}"}
    return Coding("HEVC", f"CRF {crf}", FilmQuality(encoding=Encoding(codec="libx265", options=options)))


def _vp9(crf: int) -> Coding:
    options = {"crf": str(crf), "b": "0", "deadline": "realtime", "cpu-used": "6"}
    return Coding("VP9", f"CRF {crf}", FilmQuality(encoding=Encoding(codec="libvpx-vp9", options=options)))


def _av1(crf: int) -> Coding:
    options = {"crf": str(crf), "preset": "9", "svtav1-params": "lp=1"}
    return Coding("AV1", f"CRF {crf}", FilmQuality(encoding=Encoding(codec="libsvtav1", options=options)))


_MJPEG = Encoding(codec="mjpeg", options={"qmin": "5", "qmax": "5"}, pixel_format="yuvj420p")
CODINGS = (
    Coding("H.264", "lossless", LOSSLESS),
    *(_x264(crf) for crf in (12, 18, 23, 28)),
    *(_x265(crf) for crf in (18, 28)),
    _vp9(36),
    _av1(35),
    Coding("MJPEG", "q 5", FilmQuality(encoding=_MJPEG)),
    *(
        Coding("HEVC" if quality.encoding.codec == "libx265" else "H.264", name, quality)
        for name, quality in FILM_QUALITIES.items()
    ),
)
