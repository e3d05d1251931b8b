# mujoco 4.0.0, numpy 2.4.6: after mj_step, body positions, sensors and velocities are one step older than qpos and time
#
# Behaviour: a body glides at 1 m/s with steps of 20 ms. After each mj_step qpos is where the body
#   is at data.time, while xpos and a framepos sensor still give the place of one step before: 2 cm
#   back. After mj_forward all agree.
# Guess: one step leaves one consistent state, stamped with data.time.
# So: a recording that pairs xpos or sensors with data.time carries a delay of one step, 36 degrees
#   of phase at 5 Hz with 20 ms. Record qpos, or call mj_forward before recording.
# Source: https://github.com/google-deepmind/mujoco/issues/498 and
#   https://mujoco.readthedocs.io/en/stable/programming/simulation.html#simulation-loop
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile mujoco==4.0.0 numpy==2.4.6
venv/bin/python - <<'END'
import mujoco, numpy as np
model = mujoco.MjModel.from_xml_string("""
<mujoco><option timestep="0.02" gravity="0 0 0"/>
  <worldbody><body name="robot"><freejoint/><geom size=".1" mass="1"/></body></worldbody>
  <sensor><framepos objtype="body" objname="robot"/></sensor></mujoco>""")
data = mujoco.MjData(model)
data.qvel[0] = 1.0
for _ in range(5):
    mujoco.mj_step(model, data)
    print(f"time {data.time:.2f}: qpos {data.qpos[0]:.2f}, xpos {data.xpos[1, 0]:.2f}, framepos {data.sensordata[0]:.2f}")
    assert np.isclose(data.qpos[0], data.time)
    assert np.isclose(data.xpos[1, 0], data.time - 0.02) and np.isclose(data.sensordata[0], data.time - 0.02)
mujoco.mj_forward(model, data)
print(f"after mj_forward: xpos {data.xpos[1, 0]:.2f}, framepos {data.sensordata[0]:.2f}")
assert np.isclose(data.xpos[1, 0], data.time) and np.isclose(data.sensordata[0], data.time)
END
