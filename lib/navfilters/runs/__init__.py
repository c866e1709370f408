"""Runs: one history, or many configurations, on either engine; and tests of consistency."""
