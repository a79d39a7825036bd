"""Light of the sky: sunlight scattered by the air over a round earth; numpy alone."""
