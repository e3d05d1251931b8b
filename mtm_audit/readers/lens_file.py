"""Calibrations of lenses: camera_info of ROS and what OpenCV's programs write, both YAML."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from mtm_audit.model.lens import Lens, LensModel
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import opened

_LARGEST_BYTES = 1 << 20
# Names that calibrators, and the message of ROS as its tools print it, have for the same thing.
_WIDTHS, _HEIGHTS = ("image_width", "width"), ("image_height", "height")
_MATRICES = ("camera_matrix", "k", "K", "Camera_Matrix")
_COEFFICIENTS = ("distortion_coefficients", "d", "D", "Distortion_Coefficients")
_MODELS: Mapping[str, LensModel] = {
    "plumb_bob": "radial", "rational_polynomial": "radial", "equidistant": "fisheye", "fisheye": "fisheye",
}  # fmt: skip
# OpenCV's calibrator says by a number whether a lens is a fisheye.
_FISHEYE_FLAG = "fisheye_model"
_COUNTS: Mapping[LensModel, tuple[int, ...]] = {"radial": (4, 5, 8, 12, 14), "fisheye": (4,)}
_MOST_COEFFICIENTS = 14


def read_lens(path: Path) -> Lens:
    """The lens of a calibration file. Raises MtmError when it cannot be read or does not say all that is needed."""
    content = _content(path)
    size = (_whole(path, content, _WIDTHS), _whole(path, content, _HEIGHTS))
    focal_across, skew, column, *_ = rows = _numbers(path, content, _MATRICES, 9)
    focal_down, row = rows[4], rows[5]
    if not (focal_across > 0.0 and focal_down > 0.0 and [skew, rows[3], *rows[6:]] == [0.0, 0.0, 0.0, 0.0, 1.0]):
        _refuse(path, f"whose {_MATRICES[0]} is not that of a camera (focal lengths above zero, no skew)")
    model = _model(path, content)
    distortion = tuple(_numbers(path, content, _COEFFICIENTS, None))
    if len(distortion) not in _COUNTS[model]:
        wanted = " or ".join(map(str, _COUNTS[model]))
        _refuse(path, f"with {len(distortion)} coefficients of distortion, where its model has {wanted}")
    return Lens(
        name=str(path), size_px=size, focal_px=(focal_across, focal_down), centre_px=(column, row),
        distortion=distortion, model=model,
    )  # fmt: skip


def _content(path: Path) -> Mapping[str, Any]:
    """What stands in the file's first document, all numbers as text."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    with opened(path, "the calibration") as file:
        data = file.read(_LARGEST_BYTES + 1)
    if len(data) > _LARGEST_BYTES:
        _refuse(path, f"of more than {_LARGEST_BYTES} bytes")
    text = data.decode("utf-8", "replace").removeprefix("\ufeff")
    # OpenCV 4 begins its files with %YAML:1.0, which is no directive of the language.
    lines = (line for line in text.splitlines() if not line.startswith("%"))
    try:
        content = next(iter(YAML(typ="base", pure=True).load_all("\n".join(lines))), None)
    except (YAMLError, ValueError, RecursionError) as error:
        raise MtmError(f"{path} is no YAML that can be read; name a camera's calibration (docs/filming.md)") from error
    if not isinstance(content, dict):
        _refuse(path, "without names and values")
    return content


def _model(path: Path, content: Mapping[str, Any]) -> LensModel:
    named = content.get("distortion_model")
    if named is None:
        flag = content.get(_FISHEYE_FLAG, "0")
        return "radial" if _number(flag) == 0.0 else "fisheye"
    if not isinstance(named, str) or named not in _MODELS:
        _refuse(path, f"of the distortion model {str(named)[:40]!r}, of which {', '.join(_MODELS)} are known")
    return _MODELS[named]


def _whole(path: Path, content: Mapping[str, Any], names: tuple[str, ...]) -> int:
    number = _number(_value(path, content, names))
    if not (number.is_integer() and 0.0 < number < 1e6):
        _refuse(path, f"whose {names[0]} is no number of pixels")
    return int(number)


def _numbers(path: Path, content: Mapping[str, Any], names: tuple[str, ...], count: int | None) -> list[float]:
    value = _value(path, content, names)
    if isinstance(value, dict):
        value = value.get("data")
    # Before anything is converted: aliases make long lists of short files.
    if not isinstance(value, list) or len(value) > _MOST_COEFFICIENTS:
        _refuse(path, f"whose {names[0]} is no list of numbers")
    numbers = [_number(part) for part in value]
    if not all(map(math.isfinite, numbers)) or (count is not None and len(numbers) != count):
        _refuse(path, f"whose {names[0]} is not {count or 'all'} numbers")
    return numbers


def _value(path: Path, content: Mapping[str, Any], names: tuple[str, ...]) -> Any:
    value = next((content[name] for name in names if name in content), None)
    if value is None:
        _refuse(path, f"without {names[0]}")
    return value


def _number(value: Any) -> float:
    """NaN where it is none."""
    try:
        return float(value) if isinstance(value, str) else math.nan
    except ValueError:
        return math.nan


def _refuse(path: Path, what: str) -> NoReturn:
    raise MtmError(
        f"{path} is a calibration {what}; give camera_info of ROS or what OpenCV's calibrator writes (docs/filming.md)"
    )
