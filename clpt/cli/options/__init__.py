"""Options that several commands have, and records of their values."""
