"""Arrays of doubles: states, slopes, samples."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Floating-point numbers; shapes stand where arrays are passed.
Array: TypeAlias = NDArray[np.float64]
