"""What records are made of."""

import math

NAN = math.nan
Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
NAN3: Vector3 = (NAN, NAN, NAN)
