"""Rooms, streets and desks that exist in code only, scanned by virtual instruments."""
