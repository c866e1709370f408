"""Filters: moments, variants, rules, and the update that they share."""
