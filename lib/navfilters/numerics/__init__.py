"""Numbers: small matrices in batches, derivatives, and checks of what is given."""
