"""Light of the sky: air over a round earth, and sunlight that it scatters; numpy alone."""
