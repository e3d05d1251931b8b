import os

from hypothesis import Phase, settings

# Many small matrix products lose more to threads than they gain, twentyfold when the machine is busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples in every run: `make test` says whether the program changed and not which seed was drawn. Shared
# machines are slow at odd moments, so examples are bounded in number and not in time.
settings.register_profile("plain", deadline=None, max_examples=50, derandomize=True, database=None)
# `make explore` looks for what the fixed examples miss.
settings.register_profile("explore", deadline=None, max_examples=500, database=None, print_blob=True)
# `make mutants` asks only whether some example fails, and asks it thousands of times.
settings.register_profile("mutants", settings.get_profile("plain"), phases=[Phase.explicit, Phase.generate])
settings.load_profile(os.environ.get("MTM_HYPOTHESIS", "plain"))
