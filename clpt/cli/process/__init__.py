"""What the process of a command does at signals, failures and its end."""
