# av 18.1.0: opening an output that waits for somebody to connect stops every other thread of the program
#
# Behaviour: a thread opens tcp://127.0.0.1:PORT?listen=1 for writing, where nobody connects for two
#   seconds. Another thread that sleeps for 10 ms at a time then runs once in those two seconds: the
#   interpreter's lock is held. Opening the same address for reading lets the other threads run.
# Guess: what waits for a network lets other threads run, and opening for reading and for writing are alike.
# So: serve a film from a process of its own, or mux it into memory and send that through a socket; a robot or
#   a camera program that opens an output in a thread stands still until somebody looks.
# Source: av/container/core.py and av/container/output.py of https://github.com/PyAV-Org/PyAV: opening an input is done under
#   "with nogil", avio_open of an output is not.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0
venv/bin/python - <<'END'
import socket, threading, time
import av

def longest_pause(mode):
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    url = f"tcp://127.0.0.1:{port}?listen=1&listen_timeout=2000"

    def wait():
        try:
            with av.open(url, mode, format="mpegts") as container:
                if mode == "w":
                    stream = container.add_stream("mpeg4", rate=30)
                    stream.width = stream.height = 64
                    container.mux(stream.encode(av.VideoFrame(64, 64, "yuv420p")))
        except av.FFmpegError:
            pass  # nobody came

    thread = threading.Thread(target=wait)
    thread.start()
    longest, last = 0.0, time.monotonic()
    while thread.is_alive():
        time.sleep(0.01)
        now = time.monotonic()
        longest, last = max(longest, now - last), now
    thread.join()
    return longest

reading, writing = longest_pause("r"), longest_pause("w")
print(f"longest pause of another thread: {reading:.2f} s beside an input, {writing:.2f} s beside an output")
assert writing > 1.5, "opening an output lets other threads run now"
assert reading < 1.0, "opening an input stops other threads too now"
END
