"""Every variable that a frame may have: its dimensions, type, units and meaning."""

from __future__ import annotations

from sonarsynth.pipeline.variables.target_variables import HEARD
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
    row("trajectory", ("frame",), "1", "trajectory (sequence) of the frame", dtype="int32"),
    row("step", ("frame",), "1", "step of the frame along its trajectory", dtype="int32"),
    row("time", ("frame",), "s", "time of the frame since the start of its trajectory"),
    row(
        "split",
        ("frame",),
        "1",
        "split of the dataset",
        dtype="int8",
        attributes=(("flag_values", list(range(len(SPLITS)))), ("flag_meanings", " ".join(SPLITS))),
    ),
)
_SIGNALS = group_of(
    "/signals",
    "signals",
    row("pressure", ("frame", "sensor", "sample"), "Pa", "sound pressure at each hydrophone", dtype="float32"),
    row("start", ("frame",), "s", "time of sample 0 after the instant of the frame"),
    row("clipped", ("frame",), "1", "samples at full scale of the converter", dtype="int32"),
    row("outside", ("frame",), "1", "arrivals outside the window, but reverberation: left out, counted", dtype="int32"),
)
_IMAGE = group_of(
    "/image",
    "image",
    row(
        "energy",
        BEAMS,
        "Pa2 s",
        "energy of the beam in the echo window",
        dtype="float32",
        attributes=comment("of all snaps whose echoes come then; the window is that of the first source estimate"),
    ),
    row("start", ("frame",), "s", "start of the echo window after the instant of the frame"),
    row("stop", ("frame",), "s", "end of the echo window after the instant of the frame"),
    row(
        "remainder",
        ("frame",),
        "1",
        "share of the loudest beam's energy that may be left of the direct pulse",
        dtype="float32",
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
        "dB",
        "mean square pressure of the beam over a period of the carrier, re 1 uPa, by its envelope",
        dtype="int16",
        fill=NO_LEVEL,
        attributes=(("scale_factor", LEVEL_STEP), *comment("missing: silence, or a beam that the image lacks")),
    ),
    row("start", ("frame",), "s", "time of delay 0 after the instant of the frame"),
)
_RANGES = group_of(
    "/range_image",
    "range_image",
    row(
        "energy",
        ("frame", "range", "azimuth"),
        "1",
        "power at this range of the loudest beam of this azimuth, over that of an echo as strong as the direct pulse",
        dtype="float32",
        attributes=comment(
            "beams are matched to the direct pulse; NaN: not in the echo window, or no snap was located. Ranges are by "
            "the first source estimate: echoes of another that came then are at wrong ones, by metres"
        ),
    ),
    row(
        "target",
        ("frame", "range", "azimuth"),
        "1",
        "target that a beam of this azimuth meets at this range",
        dtype="int16",
        attributes=(*NONE, *HEARD),
    ),
)
KINDS = tuple(kind.name.lower() for kind in Kind)
_PATHS = group_of(
    "/paths",
    "paths",
    row(
        "count", ("frame",), "1", "paths of the frame: the first ones along path, the rest is NaN and -1", dtype="int32"
    ),
    row("overflow", ("frame",), "1", "paths left out because there was no room: the faintest", dtype="int32"),
    row("delay", PATH, "s", "arrival at the array centre, after the instant of the frame"),
    row("azimuth", PATH, "degree", "azimuth that the path seems to come from, port positive", dtype="float32"),
    row("elevation", PATH, "degree", "elevation that the path seems to come from, up positive", dtype="float32"),
    row("radius", PATH, "m", "radius of curvature of the wavefront at the array", dtype="float32"),
    row("length", PATH, "m", "length of the whole path", dtype="float32"),
    row(
        "amplitude",
        PATH,
        "m-1",
        "pressure over that of the source at 1 m, at the centre of the band; signed",
        dtype="float32",
    ),
    row("phase", PATH, "radian", "phase of caustics and lossy reflections, at all frequencies", dtype="float32"),
    row("absorption", PATH, "dB", "absorption at the centre of the band, which is in the amplitude", dtype="float32"),
    row("delay_std", PATH, "s", "blur of roughness, a Gaussian in time", dtype="float32"),
    row("doppler", PATH, "1", "how much longer the pulse lasts", dtype="float32"),
    row("hidden", PATH, "1", "share of the hydrophones that a body hides the path from", dtype="float32"),
    row("target", PATH, "1", "target that the path met", dtype="int16", attributes=NONE),
    row("emission", PATH, "1", "snap", dtype="int16", attributes=NONE),
    row("facet", PATH, "1", "facet that the path met, in the mesh of its target", dtype="int32", attributes=NONE),
    row("kind", PATH, "1", "what the path met on its way", dtype="int8", attributes=flags(KINDS)),
    row("family", PATH, "1", "boundaries touched on the way to the array", dtype="int8", attributes=flags(FAMILIES)),
    row("lit_by", PATH, "1", "boundaries touched on the way to the target", dtype="int8", attributes=flags(FAMILIES)),
    row("surface", PATH, "1", "reflections at the surface", dtype="int8"),
    row("bottom", PATH, "1", "reflections at the bottom", dtype="int8"),
)
WHOSE = comment(
    "of the paths that bring most energy in the beam of the point at its delay. A range is wrong where the emission is "
    "not that of the source estimate that the point is placed by. Targets are where the sound met them"
)
SEVERAL = (
    *NONE,
    *comment(
        "of those whose echoes may arrive then, the one that other echoes confirm, or else the first, and then "
        "range_error holds how far from there others place it"
    ),
)
_CLOUD = group_of(
    "/cloud",
    "cloud",
    row(
        "count",
        ("frame",),
        "1",
        "points of the frame: the first ones along point, the rest is NaN and -1",
        dtype="int32",
    ),
    row("overflow", ("frame",), "1", "points left out because there was no room: the faintest", dtype="int32"),
    row("azimuth", POINT, "degree", "azimuth of the point, port positive", dtype="float32"),
    row("azimuth_error", POINT, "degree", "predicted standard error of azimuth", dtype="float32"),
    row("elevation", POINT, "degree", "elevation of the point, up positive", dtype="float32"),
    row("elevation_error", POINT, "degree", "predicted standard error of elevation", dtype="float32"),
    row("range", POINT, "m", "distance of the point from the array centre", dtype="float32"),
    row("range_error", POINT, "m", "predicted standard error of range", dtype="float32"),
    row(
        "delay", POINT, "s", "delay of the echo after the direct arrival of the first source estimate", dtype="float32"
    ),
    row("estimate", POINT, "1", "source estimate that the point is placed by", dtype="int8", attributes=SEVERAL),
    row("energy", POINT, "Pa2 s", "energy of the echo of the point, or of its beam, as it was picked", dtype="float32"),
    row("snr", POINT, "dB", "power of the peak of the echo over the mean power of noise in its beam", dtype="float32"),
    row("x", POINT, "m", "position of the point, forward, in the sonar frame", dtype="float32"),
    row("y", POINT, "m", "position of the point, to port, in the sonar frame", dtype="float32"),
    row("z", POINT, "m", "position of the point, up, in the sonar frame", dtype="float32"),
    row("target", POINT, "1", "target whose echo the point is", dtype="int16", attributes=(*NONE, *WHOSE)),
    row("emission", POINT, "1", "snap that lit the point", dtype="int16", attributes=(*NONE, *WHOSE)),
    row(
        "family",
        POINT,
        "1",
        "how the echo reached the array: a ghost but direct",
        dtype="int8",
        attributes=flags(FAMILIES),
    ),
    row("lit_by", POINT, "1", "how sound reached the target", dtype="int8", attributes=flags(FAMILIES)),
    row("facet", POINT, "1", "facet that brought most of the echo", dtype="int32", attributes=NONE),
    row(
        "true_range",
        POINT,
        "m",
        "distance of the array centre from what is heard of the target",
        dtype="float32",
    ),
    row("distance", POINT, "m", "distance of the point from the nearest surface of its target", dtype="float32"),
    row("origin", POINT, "1", "how the array came to hear the point", dtype="int8", attributes=flags(ORIGINS)),
)
_ESTIMATES = group_of(
    "/source_estimates",
    "source_estimates",
    row(
        "time",
        ESTIMATE,
        "s",
        "arrival at the array centre of the direct pulse, the peak of its envelope in the band, after the instant of "
        "the frame",
    ),
    row("time_error", ESTIMATE, "s", "predicted standard error of time"),
    row("azimuth", ESTIMATE, "degree", "azimuth of the snap as the array hears it, port positive"),
    row("azimuth_error", ESTIMATE, "degree", "predicted standard error of azimuth"),
    row("elevation", ESTIMATE, "degree", "elevation of the snap as the array hears it, up positive"),
    row("elevation_error", ESTIMATE, "degree", "predicted standard error of elevation"),
    row("range_from_depth", ESTIMATE, "m", "distance at which the bearing meets the depth of the bottom"),
    row("range_from_depth_error", ESTIMATE, "m", "predicted standard error of range_from_depth"),
    row("range_from_curvature", ESTIMATE, "m", "distance from the curvature of the wavefront"),
    row("range_from_curvature_error", ESTIMATE, "m", "predicted standard error of range_from_curvature"),
    row("position", (*ESTIMATE, "xyz"), "m", "position of the snap in the sonar frame at that time"),
    row("position_covariance", (*ESTIMATE, "xyz", "xyz_other"), "m2", "predicted covariance of position"),
    row("residual", ESTIMATE, "s", "root mean square residual of the sensor delays"),
    row(
        "bottom_used",
        ESTIMATE,
        "1",
        "whether the depth of the bottom entered the position",
        dtype="int8",
        attributes=(("flag_values", [-1, 0, 1]), ("flag_meanings", "no_position no yes")),
    ),
    row(
        "reason",
        ESTIMATE,
        "1",
        "why an estimate was not accepted",
        dtype="int8",
        attributes=(
            *flags(REASONS),
            ("comment", "of range_unknown the position alone is missing, of all others but accepted everything"),
        ),
    ),
    row(
        "emission",
        ESTIMATE,
        "1",
        "index of the true emission that the estimate came from: a label",
        dtype="int16",
        attributes=NONE,
    ),
    row(
        "usable",
        ("frame",),
        "1",
        "whether the first estimate, which is the clock, is of a snap that lights: a label",
        dtype="int8",
        attributes=comment("0: the image is by the clock of another snap, or of the end of the record, without points"),
    ),
)
VARIABLES: tuple[Variable, ...] = (
    *(*_ROOT, *_SIGNALS, *_IMAGE, *_BEAMS, *_RANGES, *_PATHS, *_CLOUD, *_ESTIMATES),
    *(*TRUTH, *SENSORS, *SOUNDSCAPE, *LEVELS),
)
"""Every variable that a frame may have."""
