"""How near poses come to the truth, and how far the truth itself can be trusted."""
