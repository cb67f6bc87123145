"""JRMPC: one Gaussian mixture for all scans."""
