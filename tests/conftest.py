from hypothesis import settings

# Shared machines are slow at odd moments, so examples are bounded in number and not in time.
settings.register_profile("plain", deadline=None, max_examples=50)
settings.load_profile("plain")
