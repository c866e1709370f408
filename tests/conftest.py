"""One deterministic hypothesis profile, so that a failure is a failure for everybody."""

from hypothesis import settings

settings.register_profile(
    "deterministic", derandomize=True, deadline=None, max_examples=50, database=None
)
settings.load_profile("deterministic")
