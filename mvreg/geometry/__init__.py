"""Rigid motions, arrays and nearest neighbours."""
