"""The figures printed in the paper, for comparison with ours."""

from __future__ import annotations

from typing import NamedTuple

SOURCE = (
    'J. Zhu et al., "Multi-view registration of unordered range scans by fast correspondence '
    'propagation of multi-scale descriptors", Tables 1 to 3'
)


class Printed(NamedTuple):
    """e_R, the mean Frobenius norm of the rotation errors; e_t, the mean translation error (mm)."""

    rotation: float
    translation: float
    minutes: float | None = None


#: How many scans the paper's sets have.
SCANS = {"armadillo": 12, "bunny": 10, "buddha": 15, "dragon": 15}

#: By data set and method.
TABLE1 = {
    ("armadillo", "ocpra"): Printed(0.0068, 0.5911),
    ("armadillo", "ocpma"): Printed(0.0099, 0.7373),
    ("armadillo", "fcpma"): Printed(0.0096, 0.7478),
    ("bunny", "ocpra"): Printed(0.0065, 0.3356),
    ("bunny", "ocpma"): Printed(0.0087, 0.4877),
    ("bunny", "fcpma"): Printed(0.0065, 0.3615),
    ("buddha", "ocpra"): Printed(0.0230, 1.3961),
    ("buddha", "ocpma"): Printed(0.0242, 1.4553),
    ("buddha", "fcpma"): Printed(0.0225, 1.4977),
    ("dragon", "ocpra"): Printed(0.0176, 1.6343),
    ("dragon", "ocpma"): Printed(0.0192, 1.7520),
    ("dragon", "fcpma"): Printed(0.0190, 1.7384),
}

#: By data set and method; FCPMA's are those of Table 1.
TABLE2 = {
    ("armadillo", "surfc"): Printed(0.0195, 0.8467),
    ("armadillo", "spant"): Printed(0.0170, 1.0233),
    ("armadillo", "fcpma"): Printed(0.0096, 0.7478),
    ("bunny", "surfc"): Printed(0.0262, 1.4734),
    ("bunny", "spant"): Printed(0.0242, 1.3588),
    ("bunny", "fcpma"): Printed(0.0065, 0.3615),
    ("buddha", "surfc"): Printed(0.0831, 1.4952),
    ("buddha", "spant"): Printed(0.0851, 1.2455),
    ("buddha", "fcpma"): Printed(0.0225, 1.4977),
    ("dragon", "surfc"): Printed(0.0245, 1.4285),
    ("dragon", "spant"): Printed(0.0219, 1.7874),
    ("dragon", "fcpma"): Printed(0.0190, 1.7384),
}

#: By order and method. Which orders the paper took is not known: ours are others.
TABLE3 = {
    ("1", "surfc"): Printed(0.0262, 1.4734, 11.8039),
    ("1", "spant"): Printed(0.0242, 1.3588, 8.5779),
    ("1", "fcpma"): Printed(0.0065, 0.3615, 1.0044),
    ("2", "surfc"): Printed(0.0280, 1.2832, 11.7961),
    ("2", "spant"): Printed(0.0295, 1.3697, 6.0479),
    ("2", "fcpma"): Printed(0.0075, 0.3264, 0.9908),
    ("3", "surfc"): Printed(0.0346, 1.9781, 11.4876),
    ("3", "spant"): Printed(0.0308, 1.6397, 9.3768),
    ("3", "fcpma"): Printed(0.0062, 0.4645, 1.2782),
    ("4", "surfc"): Printed(0.0360, 2.1528, 12.0357),
    ("4", "spant"): Printed(0.0282, 1.5158, 9.4409),
    ("4", "fcpma"): Printed(0.0052, 0.3472, 1.0956),
    ("5", "surfc"): Printed(0.0289, 1.7500, 11.9747),
    ("5", "spant"): Printed(0.0296, 1.3778, 6.2444),
    ("5", "fcpma"): Printed(0.0078, 0.3908, 1.1849),
}
