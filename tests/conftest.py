import os

from hypothesis import settings

# Many small matrix products lose more to threads than they gain, twentyfold when the machine is busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Shared machines are slow at odd moments, so examples are bounded in number and not in time.
settings.register_profile("plain", deadline=None, max_examples=50)
settings.load_profile("plain")
