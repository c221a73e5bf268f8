"""Where to go next: missions, return, takeoff, landing, hold, fence."""
