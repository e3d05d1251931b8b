# mujoco 4.0.0, numpy 2.4.6: of a free joint's six velocities three are in the world's frame and three in the body's own
#
# Behaviour: a free body rolled by 90 degrees about x, with qvel = (0.3, 0, 0, 0, 0, 1). The first
#   three are the velocity in the world, the last three the angular velocity in the body's axes: 1
#   rad/s "about z" turns about the world's -y. cvel holds angular before linear, and its linear
#   part is the velocity of the tree's centre of mass, not of the body's origin.
# Guess: one vector has one frame, and cvel of a body is the body's velocity.
# So: take velocities from mj_objectVelocity with a stated frame. The yaw rate of a robot that leans
#   is not qvel[5].
# Source: https://mujoco.readthedocs.io/en/stable/overview.html#floating-objects and
#   https://mujoco.readthedocs.io/en/stable/APIreference/APItypes.html#mjdata (cvel)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile mujoco==4.0.0 numpy==2.4.6
venv/bin/python - <<'END'
import mujoco, numpy as np
model = mujoco.MjModel.from_xml_string("""
<mujoco><option gravity="0 0 0"/><worldbody>
  <body name="robot" pos="0 0 1"><freejoint/><geom type="box" size=".1 .2 .3" pos=".5 0 0" mass="1"/></body>
</worldbody></mujoco>""")
data = mujoco.MjData(model)
data.qpos[3:7] = [np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0]
data.qvel[:] = [0.3, 0, 0, 0, 0, 1]
mujoco.mj_forward(model, data)
world = np.zeros(6)
mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, 1, world, 0)
print("qvel", data.qvel, "\nin the world: angular", world[:3].round(3), "linear at the origin", world[3:].round(3),
      "\ncvel: angular", data.cvel[1, :3].round(3), "linear", data.cvel[1, 3:].round(3))
assert np.allclose(world[:3], [0, -1, 0], atol=1e-9), "qvel[5] is no yaw rate here"
assert np.allclose(world[3:], [0.3, 0, 0], atol=1e-9), "qvel[:3] is in the world's frame"
assert np.allclose(data.cvel[1, 3:], [0.3, 0, 0.5], atol=1e-9), "cvel is at the centre of mass"
END
