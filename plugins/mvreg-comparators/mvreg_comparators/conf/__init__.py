"""The presets: `method/surfc.yaml` and `method/spant.yaml`."""
