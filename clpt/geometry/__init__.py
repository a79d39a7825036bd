"""Shapes as triangles, boxes and instances, and algorithms on them: numpy alone."""
