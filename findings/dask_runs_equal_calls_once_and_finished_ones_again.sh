# distributed 2026.8.0: equal calls run once for all of them, and calls that are finished run again when a worker is lost
#
# Behaviour: 40 submitted calls of a function that draws a random number, all with the same argument, give the same
#   number 40 times, since calls are named after function and arguments unless pure=False. Of 20 distinct calls that were
#   all finished, as their futures said, those whose results lay on a worker that is then killed run a second time when
#   the results are fetched.
# Guess: each submitted call runs, and a call that is finished has run exactly once.
# So: seeds belong into the arguments, calls get names of their own, and what a call does beside its result (rows of a
#   file, say) is done where results arrive and not in the call.
# Source: https://distributed.dask.org/en/stable/client.html (pure functions),
#   https://distributed.dask.org/en/stable/resilience.html
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile 'dask[distributed]==2026.8.0'
cat > calls.py <<'END'
import os

def draw(argument):
    return os.urandom(8).hex()

def logged(number):
    with open("begun", "a") as log:
        log.write(f"{number}\n")
    return number
END
cat > cluster.py <<'END'
import subprocess, sys, time
from distributed import Client, wait
import calls
dask = [sys.executable, "-m", "dask"]
quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
address = "tcp://127.0.0.1:38786"
programs = [subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "38786", "--no-dashboard"], **quiet)]
try:
    time.sleep(3)
    programs += [subprocess.Popen([*dask, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"], **quiet)
                 for _ in range(2)]
    with Client(address, timeout=60) as client:
        client.wait_for_workers(2, timeout=120)
        equal = len(set(client.gather(client.map(calls.draw, [0] * 40))))
        named = len(set(client.gather(client.map(calls.draw, [0] * 40, pure=False))))
        futures = client.map(calls.logged, range(20))
        wait(futures)
        finished = [future.status for future in futures].count("finished")
        before = len(open("begun").readlines())
        programs[1].kill()
        programs[1].wait()
        results = client.gather(futures)
        after = len(open("begun").readlines())
        print(f"40 equal calls gave {equal} number, with pure=False {named}; {finished} of 20 were finished after {before} "
              f"runs, and fetching their results after a worker was killed took {after - before} more")
        assert (equal, named) == (1, 40)
        assert results == list(range(20)) and (finished, before) == (20, 20) and after > 20
finally:
    for program in programs:
        program.kill()
END
PYTHONPATH=. venv/bin/python cluster.py
