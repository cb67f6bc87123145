from mvreg.kernels.trimmed_pairs import Pairing

class Acceleration:
    def __init__(self, pairing: Pairing) -> None: ...
