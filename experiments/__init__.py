"""What the tables and figures are made by; run each as python -m experiments.ROOM.NAME."""
