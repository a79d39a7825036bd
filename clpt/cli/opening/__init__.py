"""Opens scenes, devices of this machine, and the workers of a cluster, for commands that render."""
