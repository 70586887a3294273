"""Reproduces the figures, tables and pictures of the documentation. Nothing imports it; wheels leave it out."""
