"""The mathematics of the physical laws on NumPy arrays: many instants at once."""

import numpy as np

from tautwire_fmu.laws.mathematics import Mathematics

NUMPY_MATHEMATICS = Mathematics(
    log=np.log,
    exp=np.exp,
    sqrt=np.sqrt,
    sin=np.sin,
    cos=np.cos,
    tanh=np.tanh,
    atan2=np.arctan2,
    absolute=np.abs,
    maximum=np.maximum,
    where=lambda condition, a, b: np.where(condition > 0.0, a, b),
)
