# gymnasium 1.4.0, numpy 2.4.6: in a vector environment the step after an episode's end only resets and drops its action
#
# Behaviour: one environment whose episodes last 10 steps, in SyncVectorEnv with default settings.
#   Of 110 calls of step only 100 reach the environment; the 11th, 22nd, ... return the new
#   episode's first observation with reward 0, and their actions are lost. With
#   AutoresetMode.SAME_STEP all 110 reach it, but the last observation of each episode is replaced
#   by the first of the next.
# Guess: as before version 1.0, a step is a step and the reset happens within the step that ends.
# So: a message of one symbol a tick slips by one tick at each end. Count ticks by the environment's
#   own time, never by calls.
# Source: https://gymnasium.farama.org/main/api/vector/autoreset/
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile gymnasium==1.4.0 numpy==2.4.6
venv/bin/python - <<'END'
import gymnasium as gym, numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
class Episode(gym.Env):
    observation_space = gym.spaces.Box(0, 100, (1,))
    action_space = gym.spaces.Box(0, 1000, (1,))
    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.t = 0
        return np.zeros(1, np.float32), {}
    def step(self, action):
        self.t += 1
        received.append(int(action[0]))
        return np.full(1, self.t, np.float32), 1.0, self.t >= 10, False, {}
def run(**keywords):
    received.clear()
    env = SyncVectorEnv([Episode], **keywords)
    env.reset()
    seen = [int(env.step(np.array([[i]], np.float32))[0][0, 0]) for i in range(110)]
    print(keywords or "default", f"{len(received)} of 110 actions arrived, missing {sorted(set(range(110)) - set(received))[:4]}, "
          f"observations {seen[:13]}")
    return seen
received = []
seen = run()
assert len(received) == 100 and 10 not in received and seen[9:12] == [10, 0, 1]
seen = run(autoreset_mode=AutoresetMode.SAME_STEP)
assert len(received) == 110 and seen[8:11] == [9, 0, 1]
END
