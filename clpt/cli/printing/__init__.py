"""What a command prints: the progress of a render, and tables."""
