"""The system itself: its load, and failures that are injected (PX4: load_mon, failure_injection_manager)."""
