"""The process of a command: signals, failures, streams, memory."""
