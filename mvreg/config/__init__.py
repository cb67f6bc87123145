"""Configuration: composed by Hydra, read back as stages."""
