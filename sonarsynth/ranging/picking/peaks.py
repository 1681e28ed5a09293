"""Peaks of the volume of elevation, azimuth and delay, finer than its grid."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Decibels, Number
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize, Method
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes
from sonarsynth.ranging.received_window import ReceivedWindow

RANGED_BEAMS = 300
"""Beams about those over threshold, round the glints of a body: 180 to 420 in six shipped recipes. More where noise,
reverberation or a large target is heard in most: that no count tells."""


@description
class Peaks(Method):
    """Local maxima of the beams over elevation, azimuth and delay, with a parabola on each axis: the direction, delay
    and errors of an echo are its own, not those of a beam, and a direction may hold several.

    Beams about those within `threshold` of the loudest are looked at, the pulse's own waveform taken out. A maximum is
    an echo where it is within `dynamic_range` of the largest, stands out of the noise of its beam so far that noise
    alone gives `false_alarms` a frame, and is not what the array hears beside its beam: within `side_lobes` of the
    largest at the same delay, and over what side lobes and grating lobes bring of louder echoes at theirs. Whence, of
    those beyond the beam grid, is looked for along the grating lobes of each peak, where the array is a lattice.

    Measured by `tools/bench cloud`. Errors are those of noise, and of echoes that overlap: by how far the centre of the
    power about a peak is from it.
    """

    kind: Literal["peaks"] = "peaks"
    threshold: Annotated[Decibels, Gt(0)] = 12.0
    """Beams further below the loudest beam of the image are not looked at, but for those beside others."""
    dynamic_range: Annotated[Decibels, Gt(0)] = 25.0
    """Peaks further below the largest are left out."""
    false_alarms: Annotated[Number, Gt(0), Le(1000)] = 0.01
    """Peaks of Gaussian noise that are taken for echoes, a frame, on average."""
    side_lobes: Annotated[Decibels, Ge(0)] = 8.0
    """Peaks further below the largest at the same delay are taken for its side lobes."""

    def variants(self) -> dict[str, Peaks]:
        """Settings on either side of it."""
        levels = {f"threshold at {x:g} dB": replace(self, threshold=x) for x in (3.0, 6.0, 12.0, 20.0)}
        levels |= {f"dynamic range at {x:g} dB": replace(self, dynamic_range=x) for x in (10.0, 15.0, 25.0, 35.0)}
        return levels | {f"false alarms at {x:g}": replace(self, false_alarms=x) for x in (1e-4, 1e-2, 1.0)}

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: beams about the glints of a body."""
        return 2.4e-3 + min(RANGED_BEAMS, size.beams) * size.bins * 27e-9

    def picks(self, window: ReceivedWindow) -> PickedEchoes:
        """See `PickingMethod`."""
        from sonarsynth.ranging.picking.peak_picking import peak_echoes

        return peak_echoes(window, self.threshold, self.dynamic_range, self.false_alarms, self.side_lobes)
