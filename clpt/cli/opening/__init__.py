"""What a command renders with: scenes, devices of this machine, the workers of a cluster."""
