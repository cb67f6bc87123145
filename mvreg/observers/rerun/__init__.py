"""Events of a run as a Rerun recording."""
