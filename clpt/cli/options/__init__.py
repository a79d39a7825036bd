"""Options that several commands have, and the records of what they say."""
