"""The papers' experiments: constants with units and equation numbers, truth, measurements."""
