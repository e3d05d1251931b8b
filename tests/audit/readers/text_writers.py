"""Poses as text, the way programs and data sets write them."""

import numpy as np

from tests.audit.readers.moving_pose import UNIX_S


def write_tum(folder, pose):
    lines = [" ".join(f"{value:.9f}" for value in (time_s, *place, *turn)) for time_s, place, turn in pose.rows()]
    return written(folder / f"{pose.name}.tum", "\n".join(["# timestamp tx ty tz qx qy qz qw", *lines]))


def write_csv(folder, pose):
    lines = [
        f"{time_s:.6f},{place[0]:.7f},{place[1]:.7f},{yaw:.7f}"
        for (time_s, place, _), yaw in zip(pose.rows(), pose.headings_rad, strict=True)
    ]
    return written(folder / f"{pose.name}.csv", "\n".join(["time,x,y,yaw", *lines]))


def write_german_csv(folder, pose):
    """What a spreadsheet of another country exports: semicolons, decimal commas, UTF-16, millimetres."""
    lines = [
        f"{1000 * time_s:.3f};{1000 * place[0]:.4f};{1000 * place[1]:.4f};{np.rad2deg(yaw):.5f}".replace(".", ",")
        for (time_s, place, _), yaw in zip(pose.rows(), pose.headings_rad, strict=True)
    ]
    text = "\r\n".join(["Time [ms];X [mm];Y [mm];Yaw [deg]", *lines])
    return written(folder / f"{pose.name}.csv", text, "utf-16")


def write_euroc(folder, pose):
    header = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
    lines = []
    for time_s, place, (x, y, z, w) in pose.rows():
        numbers = ",".join(f"{value:.7f}" for value in (*place, w, x, y, z))
        lines.append(f"{nanoseconds(time_s)},{numbers}")
    return written(folder / f"{pose.name}.csv", "\n".join([header, *lines]))


def write_kitti(folder, pose):
    """In the frame of the camera: x to the right, y down, z ahead."""
    to_camera = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    lines = []
    for place, yaw in zip(pose.positions_m, pose.headings_rad, strict=True):
        turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        matrix = np.column_stack([to_camera @ turn @ to_camera.T, to_camera @ place])
        lines.append(" ".join(f"{value:.9e}" for value in matrix.ravel()))
    written(folder / f"{pose.name}_times.txt", "\n".join(f"{time_s:.6e}" for time_s in pose.times_s))
    return written(folder / f"{pose.name}.txt", "\n".join(lines))


def write_mrclam(folder, pose):
    lines = [
        f"{UNIX_S + time_s:.3f} \t {place[0]:.8f} \t {place[1]:.8f} \t {yaw:.8f}"
        for (time_s, place, _), yaw in zip(pose.rows(), pose.headings_rad, strict=True)
    ]
    return written(
        folder / f"{pose.name}.dat", "\n".join(["# Time [s]    x [m]    y [m]    orientation [rad]", *lines])
    )


def write_rostopic(folder, pose):
    """Rostopic echo -p of an Odometry, whose arrival is late and uneven."""
    names = [f"position.{a}" for a in "xyz"] + [f"orientation.{a}" for a in "xyzw"]
    header = ",".join(["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"] + [
        f"field.pose.pose.{name}" for name in names
    ])  # fmt: skip
    lines = []
    for index, (time_s, place, turn) in enumerate(pose.rows()):
        late_s = 0.002 + 0.004 * ((7 * index) % 5)
        numbers = ",".join(f"{value:.9f}" for value in (*place, *turn))
        lines.append(f"{nanoseconds(time_s + late_s)},{index},{nanoseconds(time_s)},odom,{numbers}")
    return written(folder / f"{pose.name}.csv", "\n".join([header, *lines]))


def write_crazyflie(folder, pose):
    lines = [
        f"{round(1000 * time_s)},{place[0]:.7f},{place[1]:.7f},{place[2]:.7f},{np.rad2deg(yaw):.5f}"
        for (time_s, place, _), yaw in zip(pose.rows(), pose.headings_rad, strict=True)
    ]
    header = "Timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z,stateEstimate.yaw"
    return written(folder / f"{pose.name}.csv", "\n".join([header, *lines]))


def write_motive(folder, *poses, version="1.23", unit="Millimeters", start="2026-01-31 01.02.03.500 PM"):
    """Rigid bodies in Motive's frame, whose y axis points up; an empty cell where a position is not known."""
    scale = {"Millimeters": 1000.0, "Meters": 1.0}[unit]
    name = poses[0].name if len(poses) == 1 else "take"
    head = [
        f"Format Version,{version},Take Name,a take,Capture Frame Rate,100.000000,Export Frame Rate,100.000000,"
        f"Capture Start Time,{start},Rotation Type,Quaternion,Length Units,{unit},Coordinate Space,Global",
        "",
    ]
    columns = [(pose.name, part, axis) for pose in poses for part, axes in (("Rotation", "XYZW"), ("Position", "XYZ"))
               for axis in axes]  # fmt: skip
    columns += [(pose.name, "Mean Marker Error", "") for pose in poses]
    head.append(",Type," + ",".join("Rigid Body" for _ in columns))
    head.append(",Name," + ",".join(column[0] for column in columns))
    head.append(",ID," + ",".join('"8392B20CF49E3573"' for _ in columns))
    head.append(",," + ",".join(column[1] for column in columns))
    head.append("Frame,Time (Seconds)," + ",".join(column[2] for column in columns))
    lines = []
    for index, time_s in enumerate(poses[0].times_s):
        cells = [str(index), f"{np.floor(1000 * time_s + 1e-6) / 1000:.6f}"]
        for pose in poses:
            x, y, z = scale * pose.positions_m[index]
            qx, qy, qz, qw = pose.quaternions_xyzw[index]
            values = (qx, qz, -qy, qw, x, z, -y)
            cells += [f"{value:.7f}" if np.isfinite(value) and np.isfinite(x) else "" for value in values]
        lines.append(",".join(cells + ["0.000123"] * len(poses)))
    return written(folder / f"{name}.csv", "\n".join([*head, *lines]))


def write_vicon(folder, *poses):
    """Objects as Tracker writes them, with a byte-order mark."""
    name = poses[0].name if len(poses) == 1 else "take"
    head = [
        "Objects", "100", ",," + ",".join(f"Global Angle {pose.name}:{pose.name},,,,," for pose in poses),
        "Frame,Sub Frame" + ",RX,RY,RZ,TX,TY,TZ" * len(poses), "," + ",rad,rad,rad,mm,mm,mm" * len(poses),
    ]  # fmt: skip
    lines = []
    for index in range(len(poses[0].times_s)):
        cells = [f"{index + 1},0"]
        for pose in poses:
            place = 1000 * pose.positions_m[index]
            cells += [
                f"0.000000,0.000000,{wrapped(pose.headings_rad[index]):.7f}",
                *(f"{value:.6f}" for value in place),
            ]
        lines.append(",".join(cells))
    return written(folder / f"{name}.csv", "\r\n".join([*head, *lines, ""]), "utf-8-sig")


def write_nexus(folder, pose, corners_m):
    """Trajectories of markers on the body as Nexus writes them, with semicolons and decimal commas."""
    head = [
        "Trajectories", "100", ";;" + ";;;".join(f"{pose.name}:m{number}" for number in range(len(corners_m))),
        "Frame;Sub Frame" + ";X;Y;Z" * len(corners_m), ";" + ";mm;mm;mm" * len(corners_m),
    ]  # fmt: skip
    lines = []
    for index, markers in enumerate(markers_m(pose, corners_m)):
        cells = [f"{1000 * value:.6f}".replace(".", ",") for value in markers.ravel()]
        lines.append(";".join([f"{index + 1};0", *cells]))
    return written(folder / f"{pose.name}.csv", "\n".join([*head, *lines]))


def write_qualisys(folder, *poses, stamp="2026-01-31, 13:02:03.500"):
    """A 6D export with a time column; a body that is not seen is all zeros."""
    name = poses[0].name if len(poses) == 1 else "take"
    parts = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual"] + [f"Rot[{number}]" for number in range(9)]
    head = [
        f"NO_OF_FRAMES\t{len(poses[0].times_s)}", "NO_OF_CAMERAS\t8", f"NO_OF_BODIES\t{len(poses)}", "FREQUENCY\t100",
        "NO_OF_ANALOG\t0", "DESCRIPTION\t--", f"TIME_STAMP\t{stamp}\t22107.99179716", "DATA_INCLUDED\t6D",
        "BODY_NAMES\t" + "\t".join(pose.name for pose in poses),
        "\t".join(["Frame", "Time", *(f"{pose.name} {parts[0]}\t" + "\t".join(parts[1:]) for pose in poses)]),
    ]  # fmt: skip
    lines = []
    for index, time_s in enumerate(poses[0].times_s):
        cells = [str(index + 1), f"{time_s:.5f}"]
        for pose in poses:
            place, yaw = 1000 * pose.positions_m[index], pose.headings_rad[index]
            cosine, sine = np.cos(yaw), np.sin(yaw)
            values = [*place, 0, 0, np.rad2deg(yaw), 0.5, cosine, sine, 0, -sine, cosine, 0, 0, 0, 1]
            cells += [f"{value:.5f}" for value in (values if np.isfinite(place).all() else [0.0] * 16)]
        lines.append("\t".join(cells))
    return written(folder / f"{name}.tsv", "\n".join([*head, *lines]))


def write_qualisys_markers(folder, pose, corners_m):
    head = [
        f"NO_OF_FRAMES\t{len(pose.times_s)}", f"NO_OF_MARKERS\t{len(corners_m)}", "FREQUENCY\t100",
        "TIME_STAMP\t2026-01-31, 13:02:03", "DATA_INCLUDED\t3D",
        "MARKER_NAMES\t" + "\t".join(f"{pose.name}_{number}" for number in range(len(corners_m))),
    ]  # fmt: skip
    lines = ["\t".join(f"{1000 * value:.5f}" for value in markers.ravel()) for markers in markers_m(pose, corners_m)]
    return written(folder / f"{pose.name}.tsv", "\n".join([*head, *lines]))


def markers_m(pose, corners_m):
    """Positions of markers at `corners_m` (markers, 3) of the body, shape (n, markers, 3)."""
    cosine, sine, zero = np.cos(pose.headings_rad), np.sin(pose.headings_rad), np.zeros(len(pose.times_s))
    turns = np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, zero + 1]])
    return np.einsum("ijn,mj->nmi", turns, np.asarray(corners_m)) + pose.positions_m[:, None]


def nanoseconds(time_s):
    """Nanoseconds since the Unix epoch, exactly."""
    return round(UNIX_S) * 1_000_000_000 + round(time_s * 1e9)


def wrapped(angle_rad):
    return float(np.angle(np.exp(1j * angle_rad)))


def written(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    return path
