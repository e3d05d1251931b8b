"""Calibrations of a lens as ROS and OpenCV write them."""

import cv2
import numpy as np

# The left camera of EuRoC's vehicle, as its makers calibrated it.
SIZE_PX, FOCAL_PX, CENTRE_PX = (752, 480), (458.654, 457.296), (367.215, 248.375)
RADIAL = (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05)
FISHEYE = (-0.012, 0.031, -0.021, 0.0045)
MATRIX = np.array([[FOCAL_PX[0], 0.0, CENTRE_PX[0]], [0.0, FOCAL_PX[1], CENTRE_PX[1]], [0.0, 0.0, 1.0]])


def camera_info(model="plumb_bob", distortion=(*RADIAL, 0.0), size_px=SIZE_PX, matrix=MATRIX):
    """As the calibrator of ROS saves it."""
    return f"""image_width: {size_px[0]}
image_height: {size_px[1]}
camera_name: cam0
camera_matrix:
  rows: 3
  cols: 3
  data: {np.ravel(matrix).tolist()}
distortion_model: {model}
distortion_coefficients:
  rows: 1
  cols: {len(distortion)}
  data: {list(distortion)}
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
"""


def camera_info_message(model="plumb_bob", distortion=(*RADIAL, 0.0)):
    """As ROS prints its messages, one after the other."""
    numbers = "\n".join(f"- {value!r}" for value in distortion)
    matrix = "\n".join(f"- {value!r}" for value in np.ravel(MATRIX).tolist())
    head = "header:\n  stamp:\n    sec: 3\n    nanosec: 5\n  frame_id: cam0\n"
    one = f"{head}height: 480\nwidth: 752\ndistortion_model: {model}\nd:\n{numbers}\nk:\n{matrix}\nbinning_x: 0\n---\n"
    return one + one


def opencv_file(path, distortion=RADIAL, fisheye=None):
    """As OpenCV's calibrator saves it, by the installed OpenCV."""
    store = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    store.write("image_width", SIZE_PX[0])
    store.write("image_height", SIZE_PX[1])
    if fisheye is not None:
        store.write("fisheye_model", int(fisheye))
    store.write("camera_matrix", MATRIX)
    store.write("distortion_coefficients", np.array(distortion)[:, None])
    store.release()
    return path
