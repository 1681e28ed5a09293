"""Error against run time on a recipe of one's own: every knob varied, frame by frame, and the plan's choices among
them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sonarsynth.conventions import finite_json
from sonarsynth.frontiers.exact_frame import exact_frame, synthesis_check
from sonarsynth.frontiers.full_frame import FullFrame, whole_points
from sonarsynth.frontiers.image_knobs import image_points, range_points
from sonarsynth.frontiers.peer_rows import image_peers, synthesis_peers
from sonarsynth.frontiers.picking_knobs import picking_points
from sonarsynth.frontiers.rows import Point, Verdict, merged
from sonarsynth.frontiers.signal_knobs import speckle_points, synthesis_points
from sonarsynth.frontiers.tracing_knobs import TracedBySensor, trace_points
from sonarsynth.frontiers.verdicts import set_by_recipe, verdicts
from sonarsynth.pipeline.synthesis import frame_signals
from sonarsynth.planning import Plan, arrivals_of
from sonarsynth.planning import plan as plan_of
from sonarsynth.recipe import Recipe

__all__ = ["AccuracyReport", "Point", "Verdict", "exact_frame", "measure", "usual_frames"]

Say = Callable[[str], None]


@dataclass(frozen=True)
class AccuracyReport:
    """The rows of a recipe's accuracy."""

    title: str
    frames: tuple[int, ...]
    hydrophones: int
    """Hydrophones that were computed exactly."""
    points: tuple[Point, ...]
    verdicts: tuple[Verdict, ...]
    choices: dict[str, Any] = field(default_factory=dict)
    own: tuple[str, ...] = ()
    """Stages whose method the recipe sets itself."""

    @property
    def ok(self) -> bool:
        """Whether the errors of all choices are within what is allowed, and the exact way itself is right."""
        return all(v.meets for v in self.verdicts) and all(p.meets for p in self.points if p.role == "check")

    def as_json(self) -> list[dict[str, Any]]:
        """A list of rows, for programs: points, peers and checks, then verdicts."""
        common = {"frames": list(self.frames), "recipe": self.title}
        rows = [p.as_json() for p in self.points] + [v.as_json() for v in self.verdicts]
        return [finite_json(row | common) for row in rows]


def usual_frames(frames: int) -> tuple[int, ...]:
    """Frames to measure: a third and two thirds of the way; a plan measures at the ends and in the middle."""
    return tuple(sorted({frames // 3, (2 * frames) // 3} - ({0} if frames > 1 else set())))


def measure(
    recipe: Recipe,
    frames: Sequence[int] | None = None,
    *,
    hydrophones: int | None = None,
    seed: int | None = None,
    peers: bool = True,
    say: Say = lambda text: None,
) -> AccuracyReport:
    """Vary each setting of a recipe about the planner's choice, and measure error and run time against exact results.

    Parameters
    ----------
    recipe: whose settings are varied.
    frames: numbers of the frames that are measured (default: `usual_frames`).
    hydrophones: how many are computed exactly (default: 4 to 24, by how long one takes).
    seed: redraws the random frames; the planner's choices stay.
    peers: whether other programs are measured too, in the first frame.
    say: called with a line of text as each part begins.

    Returns
    -------
    The points (error, CPU seconds of one core) and the verdict on each choice.

    Raises
    ------
    FieldError as `plan` does, IndexError for a frame that is not there, ValueError for no hydrophone.
    """
    if hydrophones is not None and hydrophones < 1:
        raise ValueError(f"hydrophones must be 1 or more, not {hydrophones}")
    say("planning")
    plan = plan_of(recipe)
    if seed is not None:
        plan = replace(plan_of(replace(recipe, seed=seed), choices=plan.choices), errors=plan.errors)
    chosen = usual_frames(recipe.frames) if frames is None else tuple(frames)
    points: list[Point] = []
    others, hydrophones_computed = [], 0
    for index in chosen:
        of_frame, other_seconds, count = _frame(plan, index, hydrophones, say, peers=peers and index == chosen[0])
        points += of_frame
        others.append(other_seconds)
        hydrophones_computed = count
    rows = merged(points)
    other_seconds = sum(others) / len(others)
    own = tuple(sorted(set_by_recipe(plan.scene)))
    return AccuracyReport(
        recipe.title,
        chosen,
        hydrophones_computed,
        tuple(rows),
        tuple(verdicts(rows, plan.scene, other_seconds)),
        plan.choices.as_json(),
        own,
    )


def _frame(base: Plan, index: int, hydrophones: int | None, say: Say, *, peers: bool) -> tuple[list[Point], float, int]:
    """The points of one frame; seconds of what nothing is chosen for; and hydrophones computed exactly."""
    say(f"frame {index}: exactly")
    exact = exact_frame(base, index, hydrophones)
    plan, frame = exact.plan, exact.frame
    points = [synthesis_check(exact)]
    say(f"frame {index}: tracing, {len(exact.sensor)} hydrophones")
    traced = TracedBySensor.of(plan, frame, exact.sensor)
    points += trace_points(exact, traced)
    say(f"frame {index}: synthesis")
    points += synthesis_points(traced)
    arrivals = arrivals_of(plan, frame)
    signals = frame_signals(plan, frame, arrivals)
    points += speckle_points(plan, frame, signals)
    full = FullFrame.of(exact, signals)
    say(f"frame {index}: image and range")
    points += image_points(plan, full.beamformed, peers)
    points += range_points(plan, frame, full.beamformed)
    points += picking_points(plan, frame, arrivals, full.beamformed)
    if peers:
        say(f"frame {index}: peers")
        points += synthesis_peers(plan, frame, arrivals.seen_from_centre)  # peers know no shade
        points += image_peers(plan, frame, arrivals.seen_from_centre, full.beamformed)
    say(f"frame {index}: everything exact")
    spent = full.seconds + sum(
        p.seconds for p in points if p.chosen and p.stage not in ("synthesis", "reverberation", "picking")
    )
    points += whole_points(full, traced, spent)
    return points, full.seconds, len(exact.sensor)
