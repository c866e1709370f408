"""The four works: one package each, with a command each."""
