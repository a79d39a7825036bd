"""Prints the progress of a render, and tables."""
