"""Thin scans out."""
