"""Stored truth, and the link budget of levels."""

from __future__ import annotations

from sonarsynth.pipeline.variables.target_variables import HEARD, SIGNAL_TO_NOISE, TARGETS
from sonarsynth.pipeline.variables.variable import (
    BEAMS,
    CELL,
    EMISSION,
    LOUDEST,
    NONE,
    SENSOR,
    comment,
    group_of,
    row,
)
from sonarsynth.receiver.sensor_errors import SensorState

_MEAN = "mean from the instant of the frame until it hears echoes of the loudest snap"
_SONAR = group_of(
    "/truth",
    "truth",
    row("sonar_position", ("frame", "xyz"), "m", "position of the array centre in the world"),
    row("sonar_orientation", ("frame", "wxyz"), "1", "unit quaternion from the sonar frame to the world"),
    row("sonar_velocity", ("frame", "xyz"), "m s-1", f"velocity of the array in the world, {_MEAN}"),
    row("sonar_spin", ("frame", "xyz"), "rad s-1", f"angular velocity of the array in the world, {_MEAN}"),
)
_EMISSIONS = group_of(
    "/truth/emissions",
    "truth",
    row("source", EMISSION, "1", "number of the source in the recipe", dtype="int16", attributes=NONE),
    row("position", (*EMISSION, "xyz"), "m", "position of the snap in the world"),
    row(
        "position_at_arrival",
        (*EMISSION, "xyz"),
        "m",
        "position of the snap in the sonar frame when its direct pulse arrives; NaN without a direct path",
        product="levels",
    ),
    row("time", EMISSION, "s", "time of the snap after the instant of the frame"),
    row("level", EMISSION, "dB", "peak source level of the snap re 1 uPa at 1 m"),
    row(
        "arrival",
        EMISSION,
        "s",
        "arrival at the array centre of the snap's direct pulse, the peak of its envelope in the band, after the "
        "instant of the frame; NaN without a direct path",
        product="levels",
    ),
    row("azimuth", EMISSION, "degree", "azimuth that the direct pulse arrives from, port positive", product="levels"),
    row("elevation", EMISSION, "degree", "elevation that the direct pulse arrives from, up positive", product="levels"),
)
_BEAMS = group_of(
    "/truth/beams",
    "truth",
    row("target", BEAMS, "1", "target that the beam points at", dtype="int16", attributes=(*NONE, *HEARD)),
    row("facet", BEAMS, "1", "facet that the beam points at", dtype="int32", attributes=(*NONE, *HEARD)),
    row(
        "range",
        BEAMS,
        "m",
        "distance to the first surface in the beam's direction",
        dtype="float32",
        attributes=HEARD,
    ),
    row(
        "coverage",
        BEAMS,
        "1",
        "share of the solid angle of the beam's cell, which ends half way to the next beams, that targets cover",
        dtype="float32",
        attributes=comment(
            "errs by 0.002 rms, 0.02 at most, at an edge; target, facet and range are of the middle of the cell alone"
        ),
    ),
)
SENSORS = group_of(
    "/truth/sensors",
    "sensors",
    row("gain", SENSOR, "dB", "sensitivity of the channel over its nominal one", dtype="float32"),
    row(
        "phase", SENSOR, "degree", "phase of the channel at positive frequencies, alike at all of them", dtype="float32"
    ),
    row("delay", SENSOR, "s", "how late the channel is sampled, positive: it shows what came earlier", dtype="float32"),
    row("position_error", (*SENSOR, "xyz"), "m", "where the hydrophone is, less where it should be", dtype="float32"),
    row(
        "state",
        SENSOR,
        "1",
        "what the channel is",
        dtype="int8",
        attributes=(
            ("flag_values", [int(v) for v in SensorState]),
            ("flag_meanings", " ".join(v.name.lower() for v in SensorState)),
        ),
    ),
    row("clock_rate", ("frame",), "1e-6", "how much faster time passes between samples than it should"),
)
"""What is wrong with the sensors, where a recipe describes that."""
SOUNDSCAPE = group_of(
    "/truth/soundscape",
    "chorus",
    row("snaps", ("frame",), "1", "snaps of the chorus that reach the array centre within the record", dtype="int32"),
    row("paths", ("frame",), "1", "their paths: direct, and by surface and bottom", dtype="int32"),
    row(
        "level",
        LOUDEST,
        "dB",
        "peak level of the loudest paths at the array centre re 1 uPa, before the filter",
        attributes=comment("absorbed as at the centre of the band; NaN where there are fewer"),
    ),
    row("arrival", LOUDEST, "s", "when they arrive, after the instant of the frame"),
    row("azimuth", LOUDEST, "degree", "azimuth that they arrive from, port positive"),
    row("elevation", LOUDEST, "degree", "elevation that they arrive from, up positive"),
    row(
        "clear",
        ("frame",),
        "1",
        "whether no snap of the chorus is louder than the echoes of the loudest target, in the echo window",
        dtype="int8",
        attributes=comment("1 clear, 0 not, -1 where nothing echoes; the true window after each snap that lights"),
        product="chorus and levels",
    ),
)
"""Of the chorus, where a scene has one."""
TRUTH = (*_SONAR, *TARGETS, *SIGNAL_TO_NOISE, *_EMISSIONS, *_BEAMS)
"""True poses, emissions and beams."""
HOW_LEVELS_ADD_UP = (
    "received = source - transmission_loss_out + scattering - transmission_loss_in - absorption - boundary. Ratios of "
    "energies in the band of the sonar; of coherent paths the pressures are summed, of others the powers. Losses are "
    "means over the paths, weighted by power; scattering has what phases add or cancel."
)
"""Stored with each level of the link budget."""

_LEVELS = {
    "source_level": "peak source level of the snap re 1 uPa at 1 m",
    "transmission_loss_out": "spreading loss from snap to target (snap to array for the direct path), and what the "
    "beam of a transmitter takes on that way",
    "scattering": "scattering of all facets together: target strength",
    "transmission_loss_in": "spreading loss from target to array",
    "absorption_loss": "absorption along the whole path",
    "boundary_loss": "loss at surface and bottom; less than 0 where a snap on the bottom and its image add up",
    "received_level": "level at the array centre re 1 uPa: peak of a snap of the energy in the band",
}
LEVELS = group_of(
    "/link_budget",
    "levels",
    *(row(name, CELL, "dB", text, attributes=comment(HOW_LEVELS_ADD_UP)) for name, text in _LEVELS.items()),
    row("paths", CELL, "1", "number of paths", dtype="int32"),
    row("isolated_level", CELL, "dB", "received level of the loudest path of the family alone, predicted"),
    row(
        "measured_level",
        CELL,
        "dB",
        "level of that path measured in its signals",
        attributes=comment("the path alone, synthesised at one ideal hydrophone in the array centre"),
        product="signals",
    ),
    row("isolated_facet", CELL, "1", "facet of that path in the mesh of its target", dtype="int32", attributes=NONE),
    row("error_bound", CELL, "dB", "bound on the error of each level from the approximations made; NaN without one"),
    row(
        "wavefront_error",
        ("frame",),
        "s",
        "largest error of wavefronts measured at probes over the aperture; NaN where one has no ray",
    ),
    row(
        "amplitude_error",
        ("frame",),
        "1",
        "largest error of amplitudes measured at those probes, relative to the strongest echo",
    ),
)
