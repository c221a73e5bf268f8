"""What a vehicle senses: truth in, readings out, each with its own noise (numbers: `vehicles/<model>/vehicle.toml`)."""
