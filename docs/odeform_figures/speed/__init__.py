"""Figures of speed beyond those of `odeform bench`."""
