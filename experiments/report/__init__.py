"""The pages and figures in experiments/results."""
