"""What a vehicle is, as pages of data, and the dynamics they need."""
