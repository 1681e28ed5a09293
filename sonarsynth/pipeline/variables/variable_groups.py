"""Every variable that a frame may have: its dimensions, type, units and meaning."""

from __future__ import annotations

from sonarsynth.pipeline.variables.truth_variables import LEVELS, SENSORS, SOUNDSCAPE, TRUTH
from sonarsynth.pipeline.variables.variable import (
    BEAMS,
    ESTIMATE,
    NONE,
    PATH,
    POINT,
    Variable,
    comment,
    flags,
    group_of,
    row,
)
from sonarsynth.products import FAMILIES, ORIGINS, REASONS, SPLITS, Kind

_ROOT = group_of(
    "/",
    "truth",
    row("trajectory", ("frame",), "int32", "1", "trajectory (sequence) of the frame"),
    row("step", ("frame",), "int32", "1", "step of the frame along its trajectory"),
    row("time", ("frame",), "float64", "s", "time of the frame since the start of its trajectory"),
    row(
        "split",
        ("frame",),
        "int8",
        "1",
        "split of the dataset",
        attributes=(("flag_values", list(range(len(SPLITS)))), ("flag_meanings", " ".join(SPLITS))),
    ),
)
_SIGNALS = group_of(
    "/signals",
    "signals",
    row("pressure", ("frame", "sensor", "sample"), "float32", "Pa", "sound pressure at each hydrophone"),
    row("start", ("frame",), "float64", "s", "time of sample 0 after the instant of the frame"),
    row("clipped", ("frame",), "int32", "1", "samples at full scale of the converter"),
    row("outside", ("frame",), "int32", "1", "arrivals outside the window: left out, counted"),
)
_IMAGE = group_of(
    "/image",
    "image",
    row("energy", BEAMS, "float32", "Pa2 s", "energy of the beam in the echo window"),
    row("start", ("frame",), "float64", "s", "start of the echo window after the instant of the frame"),
    row("stop", ("frame",), "float64", "s", "end of the echo window after the instant of the frame"),
    row(
        "remainder",
        ("frame",),
        "float32",
        "1",
        "share of the loudest beam's energy that may be left of the direct pulse",
        attributes=comment("the direct pulse is taken out; beams with more than a quarter of this are NaN"),
    ),
)
LEVEL_STEP, NO_LEVEL = 0.01, -(2**15)
"""dB that levels of beams are rounded to; what stands for none."""
_BEAMS = group_of(
    "/beams",
    "beams",
    row(
        "level",
        (*BEAMS, "delay"),
        "int16",
        "dB",
        "mean square pressure of the beam over a period of the carrier, re 1 uPa, by its envelope",
        fill=NO_LEVEL,
        attributes=(("scale_factor", LEVEL_STEP), *comment("missing: silence, or a beam that the image lacks")),
    ),
    row("start", ("frame",), "float64", "s", "time of delay 0 after the instant of the frame"),
)
KINDS = tuple(kind.name.lower() for kind in Kind)
_PATHS = group_of(
    "/paths",
    "paths",
    row("count", ("frame",), "int32", "1", "paths of the frame: the first ones along path, the rest is NaN and -1"),
    row("overflow", ("frame",), "int32", "1", "paths left out because there was no room: the faintest"),
    row("delay", PATH, "float64", "s", "arrival at the array centre, after the instant of the frame"),
    row("azimuth", PATH, "float32", "degree", "azimuth that the path seems to come from, port positive"),
    row("elevation", PATH, "float32", "degree", "elevation that the path seems to come from, up positive"),
    row("radius", PATH, "float32", "m", "radius of curvature of the wavefront at the array"),
    row("length", PATH, "float32", "m", "length of the whole path"),
    row(
        "amplitude",
        PATH,
        "float32",
        "m-1",
        "pressure over that of the source at 1 m, at the centre of the band; signed",
    ),
    row("phase", PATH, "float32", "radian", "phase of caustics and lossy reflections, at all frequencies"),
    row("absorption", PATH, "float32", "dB", "absorption at the centre of the band, which is in the amplitude"),
    row("delay_std", PATH, "float32", "s", "blur of roughness, a Gaussian in time"),
    row("doppler", PATH, "float32", "1", "how much longer the pulse lasts"),
    row("hidden", PATH, "float32", "1", "share of the hydrophones that a body hides the path from"),
    row("target", PATH, "int16", "1", "target that the path met", attributes=NONE),
    row("emission", PATH, "int16", "1", "snap", attributes=NONE),
    row("facet", PATH, "int32", "1", "facet that the path met, in the mesh of its target", attributes=NONE),
    row("kind", PATH, "int8", "1", "what the path met on its way", attributes=flags(KINDS)),
    row("family", PATH, "int8", "1", "boundaries touched on the way to the array", attributes=flags(FAMILIES)),
    row("lit_by", PATH, "int8", "1", "boundaries touched on the way to the target", attributes=flags(FAMILIES)),
    row("surface", PATH, "int8", "1", "reflections at the surface"),
    row("bottom", PATH, "int8", "1", "reflections at the bottom"),
)
WHOSE = comment(
    "of the paths that bring most energy in the beam of the point at its delay. A range is wrong where the emission is "
    "not that of the first source estimate. Targets are where the sound met them"
)
_CLOUD = group_of(
    "/cloud",
    "cloud",
    row("count", ("frame",), "int32", "1", "points of the frame: the first ones along point, the rest is NaN and -1"),
    row("overflow", ("frame",), "int32", "1", "points left out because there was no room: the faintest"),
    row("azimuth", POINT, "float32", "degree", "azimuth of the point, port positive"),
    row("azimuth_error", POINT, "float32", "degree", "predicted standard error of azimuth"),
    row("elevation", POINT, "float32", "degree", "elevation of the point, up positive"),
    row("elevation_error", POINT, "float32", "degree", "predicted standard error of elevation"),
    row("range", POINT, "float32", "m", "distance of the point from the array centre"),
    row("range_error", POINT, "float32", "m", "predicted standard error of range"),
    row("delay", POINT, "float32", "s", "delay of the echo after the direct arrival of the snap"),
    row(
        "energy",
        POINT,
        "float32",
        "Pa2 s",
        "energy of the echo of the point, or of its beam, as it was picked",
    ),
    row("snr", POINT, "float32", "dB", "power of the peak of the echo over the mean power of noise in its beam"),
    row("x", POINT, "float32", "m", "position of the point, forward, in the sonar frame"),
    row("y", POINT, "float32", "m", "position of the point, to port, in the sonar frame"),
    row("z", POINT, "float32", "m", "position of the point, up, in the sonar frame"),
    row("target", POINT, "int16", "1", "target whose echo the point is", attributes=(*NONE, *WHOSE)),
    row("emission", POINT, "int16", "1", "snap that lit the point", attributes=(*NONE, *WHOSE)),
    row("family", POINT, "int8", "1", "how the echo reached the array: a ghost but direct", attributes=flags(FAMILIES)),
    row("lit_by", POINT, "int8", "1", "how sound reached the target", attributes=flags(FAMILIES)),
    row("facet", POINT, "int32", "1", "facet that brought most of the echo", attributes=NONE),
    row("true_range", POINT, "float32", "m", "distance of the array centre from where the echo was made"),
    row("distance", POINT, "float32", "m", "distance of the point from the nearest surface of its target"),
    row("origin", POINT, "int8", "1", "how the array came to hear the point", attributes=flags(ORIGINS)),
)
_ESTIMATES = group_of(
    "/source_estimates",
    "source_estimates",
    row(
        "time",
        ESTIMATE,
        "float64",
        "s",
        "arrival at the array centre of the direct pulse, the peak of its envelope in the band, after the instant of "
        "the frame",
    ),
    row("time_error", ESTIMATE, "float64", "s", "predicted standard error of time"),
    row("azimuth", ESTIMATE, "float64", "degree", "azimuth of the snap as the array hears it, port positive"),
    row("azimuth_error", ESTIMATE, "float64", "degree", "predicted standard error of azimuth"),
    row("elevation", ESTIMATE, "float64", "degree", "elevation of the snap as the array hears it, up positive"),
    row("elevation_error", ESTIMATE, "float64", "degree", "predicted standard error of elevation"),
    row("range_from_depth", ESTIMATE, "float64", "m", "distance at which the bearing meets the depth of the bottom"),
    row("range_from_depth_error", ESTIMATE, "float64", "m", "predicted standard error of range_from_depth"),
    row("range_from_curvature", ESTIMATE, "float64", "m", "distance from the curvature of the wavefront"),
    row("range_from_curvature_error", ESTIMATE, "float64", "m", "predicted standard error of range_from_curvature"),
    row("position", (*ESTIMATE, "xyz"), "float64", "m", "position of the snap in the sonar frame at that time"),
    row("position_covariance", (*ESTIMATE, "xyz", "xyz_other"), "float64", "m2", "predicted covariance of position"),
    row("residual", ESTIMATE, "float64", "s", "root mean square residual of the sensor delays"),
    row(
        "bottom_used",
        ESTIMATE,
        "int8",
        "1",
        "whether the depth of the bottom entered the position",
        attributes=(("flag_values", [-1, 0, 1]), ("flag_meanings", "no_position no yes")),
    ),
    row(
        "reason",
        ESTIMATE,
        "int8",
        "1",
        "why an estimate was not accepted",
        attributes=(
            *flags(REASONS),
            ("comment", "of range_unknown the position alone is missing, of all others but accepted everything"),
        ),
    ),
    row(
        "emission",
        ESTIMATE,
        "int16",
        "1",
        "index of the true emission that the estimate came from: a label",
        attributes=NONE,
    ),
    row(
        "usable",
        ("frame",),
        "int8",
        "1",
        "whether the first estimate, which is the clock, is of a snap that lights: a label",
        attributes=comment("0: the image is by the clock of another snap, or of the end of the record, without points"),
    ),
)
VARIABLES: tuple[Variable, ...] = (
    *(*_ROOT, *_SIGNALS, *_IMAGE, *_BEAMS, *_PATHS, *_CLOUD, *_ESTIMATES),
    *(*TRUTH, *SENSORS, *SOUNDSCAPE, *LEVELS),
)
"""Every variable that a frame may have."""
