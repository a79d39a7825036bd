"""What the compilers of GPUs that are not here make of every program of the scenes."""
