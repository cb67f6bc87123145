"""Poses in the formats of other programs; `mvreg/export/README.md` has their conventions."""
