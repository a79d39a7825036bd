"""Rendering: lowering a scene, the kernel text for it, and the wavefront that runs it."""
