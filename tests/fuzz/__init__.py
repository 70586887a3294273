"""Damaged and hostile inputs for every reader. `python -m tests.fuzz` runs any number of them; see `__main__`."""
