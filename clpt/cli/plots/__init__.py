"""The plots of commands, by matplotlib."""
