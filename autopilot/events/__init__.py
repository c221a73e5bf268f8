"""What people are told: events, and the texts that older ground stations show (PX4: lib/events)."""
