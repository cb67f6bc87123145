"""Runs compared: what differs in their configuration, and what they measured."""
