"""For authors of plugins: a plugin to begin with, and checks of those that are installed."""
