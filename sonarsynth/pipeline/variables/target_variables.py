"""Stored truth of targets."""

from __future__ import annotations

from sonarsynth.pipeline.variables.variable import ECHO, EMISSION, TARGET, comment, group_of, row
from sonarsynth.products import VIEWS, View

INSTANT = comment("at the instant of the frame; what is heard is of when sound met the target: position_at_echo")
"""Of what is where it is then."""
HEARD = comment(
    "as the array hears the loudest snap that lights a target: where its sound met the target, from where the array is "
    "when it hears that; at the instant of the frame where it hears none"
)
"""Of what is in the sonar's frame."""
_MEETING = comment(
    "where the sound met the target is what echoes, images and points show; other poses are those of the instant of "
    "the frame. Sound by surface or bottom meets it later. NaN where no direct path leads to it"
)
_YES = (("flag_values", [0, 1]), ("flag_meanings", "no yes"))
TARGETS = group_of(
    "/truth/targets",
    "truth",
    row("present", TARGET, "1", "whether the target is in the sequence", dtype="int8", attributes=_YES),
    row("category", TARGET, "1", "what a detector is to call the target", dtype="int16"),
    row(
        "clutter",
        TARGET,
        "1",
        "whether it is clutter, which no detector is asked to find",
        dtype="int8",
        attributes=_YES,
    ),
    row("scale", TARGET, "1", "size of the target over that of its mesh"),
    row("mesh", TARGET, "1", "which mesh of its group it has, where there are several", dtype="int32"),
    row(
        "position",
        (*TARGET, "xyz"),
        "m",
        "position of the target's origin in the world",
        attributes=INSTANT,
    ),
    row(
        "position_at_echo",
        (*EMISSION, "target", "xyz"),
        "m",
        "position of the target's origin in the world when the sound of the snap, by the direct path, met it",
        attributes=_MEETING,
    ),
    row(
        "orientation_at_echo",
        (*EMISSION, "target", "wxyz"),
        "1",
        "unit quaternion from the target's frame to the world when the sound of the snap, by the direct path, met it",
        attributes=_MEETING,
    ),
    row(
        "meeting_time",
        (*EMISSION, "target"),
        "s",
        "time after the instant of the frame when the sound of the snap, by the direct path, met the target's origin",
        attributes=_MEETING,
    ),
    row(
        "orientation",
        (*TARGET, "wxyz"),
        "1",
        "unit quaternion from the target's frame to the world",
        attributes=INSTANT,
    ),
    row("velocity", (*TARGET, "xyz"), "m s-1", "velocity of the target in the world"),
    row("box", (*TARGET, "corner", "xyz"), "m", "corners of the oriented bounding box, sonar frame", attributes=HEARD),
    row(
        "box_centre",
        (*TARGET, "xyz"),
        "m",
        "centre of the oriented bounding box, sonar frame",
        attributes=comment("corners of box, first to last: centre + R (+-size/2), R of box_orientation, z fastest"),
    ),
    row("box_size", (*TARGET, "xyz"), "m", "size of the oriented bounding box along the target's axes"),
    row(
        "box_orientation",
        (*TARGET, "wxyz"),
        "1",
        "unit quaternion from the target's frame to the sonar frame, w not negative",
    ),
    row(
        "yaw",
        TARGET,
        "degree",
        "azimuth that the target's bow points to, sonar frame, port positive",
        attributes=comment("0: away from the array; NaN where the bow points straight up or down in the sonar frame"),
    ),
    row(
        "image_box",
        (*TARGET, "bound"),
        "degree",
        "bounds in azimuth and elevation of the visible part in view",
        attributes=comment(
            "where the array sees it when it hears it, rays bent; cut at the first and last beam each way; NaN "
            "where nothing is in view, see view"
        ),
    ),
    row(
        "true_image_box",
        (*TARGET, "bound"),
        "degree",
        "the same bounds by straight lines from the array centre: where the target is, not where it appears",
        attributes=comment("image_box where rays are straight"),
    ),
    row(
        "full_box",
        (*TARGET, "bound"),
        "degree",
        "bounds in azimuth and elevation of the whole target, hidden or not, in the view of the beams or not",
        attributes=comment("where the array would see it; of the part at x > 0 alone; NaN where none is there"),
    ),
    row(
        "pixel_box",
        (*TARGET, "side"),
        "1",
        "image_box in beams of the grid: beam (row i, column j) is at y = i + 0.5, x = j + 0.5",
        attributes=comment("x with azimuth, to port; y with elevation, up. NaN where nothing is in view, see view"),
    ),
    row(
        "view",
        TARGET,
        "1",
        "how much of the visible part is in the view of the beams",
        dtype="int8",
        attributes=(("flag_values", [int(v) for v in View]), ("flag_meanings", VIEWS)),
    ),
    row(
        "in_view",
        TARGET,
        "1",
        "whether any part of the target, hidden or not, is in the view of the beams",
        dtype="int8",
        attributes=(("flag_values", [-1, 0, 1]), ("flag_meanings", "not_there no yes")),
    ),
    row(
        "truncation",
        TARGET,
        "1",
        "share of the solid angle of the visible part that is outside the view of the beams",
        attributes=comment("0 in view, 1 outside it or behind; NaN where the target is hidden"),
    ),
    row(
        "visible_fraction",
        TARGET,
        "1",
        "share of the area facing the array that the array sees",
        attributes=comment(
            "whether it is in the view of the beams or not; of whole facets, by rays from their middles"
        ),
    ),
    row(
        "lit_fraction",
        (*EMISSION, "target"),
        "1",
        "share of the area that the array sees that the direct sound of the emission meets",
        attributes=comment(
            "facing the snap, and past all bodies, where its sound meets them; whole facets, by rays to their middles; "
            "0 of what is heard but lights nothing; NaN where the target is hidden from the array"
        ),
    ),
    row(
        "points",
        TARGET,
        "1",
        "points of the cloud that are echoes of the target, by any way",
        dtype="int32",
        product="cloud",
    ),
    row(
        "echo_azimuth",
        ECHO,
        "degree",
        "azimuth that the target's echoes come from, weighted by power",
        product="levels",
    ),
    row(
        "echo_elevation",
        ECHO,
        "degree",
        "elevation that they come from: ghosts by surface and bottom",
        product="levels",
    ),
    row(
        "echo_level", ECHO, "dB", "level of the target's echoes re 1 uPa, of their energy in the band", product="levels"
    ),
)
"""Poses, boxes, and what the array sees and hears of each target."""
_PARTS = {
    "chorus": "snaps of the chorus",
    "reverberation": "what bottom, surface and water scatter",
    "noise": "ambient noise, and sources of noise",
    "electronics": "noise of the electronics",
}
_BROUGHT = comment(
    "10 lg of the energy in the window of the image, re 1 uPa2 s, summed over the beams that /truth/beams gives the "
    "target (the nearest one where it is between beams) by delay and sum, each part by itself, without errors of "
    "sensors and converter; -200 dB stands for silence; NaN: no beam points at the target, or nothing is recorded then"
)
SIGNAL_TO_NOISE = group_of(
    "/truth/targets",
    "snr",
    row(
        "snr",
        TARGET,
        "dB",
        "energy of the target's echoes in its beams over that of chorus, reverberation, noise and electronics there",
        attributes=comment("echoes of other targets and the direct pulse are left out; silence counts as -200 dB"),
    ),
    row("echo_energy", TARGET, "dB", "energy in the target's beams of its echoes", attributes=_BROUGHT),
    *(
        row(
            f"{name}_energy",
            TARGET,
            "dB",
            f"energy in the target's beams of {what}",
            attributes=_BROUGHT,
            product=f"snr {name}",
        )
        for name, what in _PARTS.items()
    ),
)
"""What the array hears of each target, and what else in its beams, where a scene has anything else."""
