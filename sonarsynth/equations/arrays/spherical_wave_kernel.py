"""The sums of a fit of a spherical wave over the sensors of an array: the compiled kernel of source estimates."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled


@compiled
def normal_equations(
    position: Any, delay: Any, weight: Any, u: Any, curvature: float, sound_speed: float, tangents: Any
) -> Any:
    """J^T W J (4, 4), J^T W (t - tau) and J^T W tau (4,) of delays t (sensor,) about the wave's own, tau.

    Also t - tau (sensor,) and J (sensor, 4); the order of parameters, and J, are those of `spherical_wave.Wavefront`.
    """
    sensors = len(delay)
    jacobian, late = np.empty((sensors, 4)), np.empty(sensors)
    normal, right, own = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
    for q in range(sensors):
        x, y, z = position[q]
        along, square = x * u[0] + y * u[1] + z * u[2], x * x + y * y + z * z
        bent = curvature * along
        rho = np.sqrt(1 - 2 * bent + curvature**2 * square)
        j = jacobian[q]
        for i in range(2):
            j[i] = -(x * tangents[i, 0] + y * tangents[i, 1] + z * tangents[i, 2]) / (sound_speed * rho)
        j[2] = (square - along * along) / (sound_speed * rho * (1 + rho - bent))
        j[3] = 1.0
        tau = (curvature * square - 2 * along) / (sound_speed * (1 + rho))
        late[q] = delay[q] - tau
        for i in range(4):
            wj = weight[q] * j[i]
            right[i] += wj * late[q]
            own[i] += wj * tau
            for k in range(i + 1):
                normal[i, k] += wj * j[k]
    for i in range(4):
        for k in range(i):
            normal[k, i] = normal[i, k]
    return normal, right, own, late, jacobian
