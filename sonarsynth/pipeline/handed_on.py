"""What the tasks of a frame hand on to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from sonarsynth.conventions import Floats
from sonarsynth.pipeline.stored_values import Values
from sonarsynth.products import Arrivals, BeamSpectra, Echoes, EnergyImage, LinkBudget, Signals, SourceEstimates, Truth
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.chorus.chorus_arrivals import ChorusArrivals

Sound = dict[int, Callable[[], Signals]]
"""What gives the signals of each target, numbered as in `Recorder.echo`."""


@dataclass(frozen=True, eq=False)
class TracedFrame:
    """What the trace task gives."""

    frame: Frame
    arrivals: Arrivals
    truth: Truth
    budget: LinkBudget
    echoes: Echoes
    chorus: ChorusArrivals | None = None  # None: the scene has none
    reverberation: ReverberationArrivals | None = None
    isolated: Floats | None = None  # (snap, target + 1, family) dB: isolated paths of the link budget, in signals


@dataclass(frozen=True, eq=False)
class BeamformedFrame:
    """What the beamform task gives; None where no product needs it."""

    signals: Signals  # as processing has them
    estimates: SourceEstimates | None
    image: EnergyImage | None
    imaged: Signals | None = None  # that the image was made of: without direct pulses and reflections that were removed
    beams: BeamSpectra | None = None  # of the echo window of these
    values: Values = field(default_factory=dict)  # to store: signals as the converter gave them, signal to noise
