"""Best first: partial models grow from the most promising pairs."""
