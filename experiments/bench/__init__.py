"""Time, memory and scaling of mvreg and of its baselines."""
