"""What range scans show of a pose, and how probable that makes it."""
