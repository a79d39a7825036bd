"""Algorithms on plain arrays of points and corners."""
