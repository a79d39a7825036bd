"""Many devices and machines: who renders which samples, and what travels between them."""
