"""Time, memory and growth, of mvreg and of its peers."""
