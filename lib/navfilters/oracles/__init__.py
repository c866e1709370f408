"""The independent second computations; they import nothing from the rest of the package."""
