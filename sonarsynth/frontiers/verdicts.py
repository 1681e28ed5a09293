"""Whether the plan's choices keep within the accuracy, and whether anything on the walk that does costs much less."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, isnan

from sonarsynth.frontiers.rows import STAGES, Point, Verdict
from sonarsynth.recipe.scene import Scene

SLOWER = 1.5
"""A choice may cost so many times what the cheapest one does that keeps within the accuracy."""


def verdicts(points: Sequence[Point], scene: Scene, other_seconds: float) -> list[Verdict]:
    """One for each stage that was walked, and one for the whole frame; other_seconds: of what nothing is chosen
    for."""
    walked = {s: [p for p in points if p.stage == s and p.role == "point"] for s in STAGES}
    chosen = {s: next((p for p in of_stage if p.chosen), None) for s, of_stage in walked.items()}
    own = set_by_recipe(scene)
    judged = []
    for stage in ("trace", "synthesis", "image", "range"):
        row = chosen[stage]
        if row is None:
            continue
        partner = chosen[PAIR[stage]] if stage in PAIR else None
        beside = 0.0 if partner is None or not partner.meets else partner.error
        best = cheapest(walked[stage], beside)
        judged.append(_verdict(row, row.setting, best, stage in own))
    frame = [p for p in walked["frame"] if p.chosen]
    if frame:
        knobs = {p.knob for p in frame}
        alone = [row for stage in ("image", "range") if (row := chosen[stage]) is not None and stage not in knobs]
        judged.append(_whole([*frame, *alone], walked, other_seconds, own))
    return judged


PAIR = {"trace": "synthesis", "synthesis": "trace"}
"""Stages that share one tolerance: their errors add by squares."""


def set_by_recipe(scene: Scene) -> set[str]:
    """Stages whose method the recipe sets itself."""
    physics, processing = scene.physics, scene.processing
    settings = {
        "trace": physics.subarrays != "auto" or physics.dynamic_range != "auto" or physics.tracing.kind != "auto",
        "synthesis": physics.synthesis.kind != "auto",
        "image": getattr(processing.beamforming, "kind", "") != "auto",
        "range": processing.placing.kind != "auto",
    }
    return {stage for stage, own in settings.items() if own}


def cheapest(points: Sequence[Point], beside: float = 0.0) -> Point | None:
    """The cheapest point that keeps within the accuracy together with another error."""
    good = [p for p in points if hypot(p.error, beside) <= p.allowed]
    return min(good, key=lambda p: p.seconds, default=None)


def _verdict(row: Point, choice: str, best: Point | None, own: bool) -> Verdict:
    seconds = best.seconds if best is not None else float("nan")
    name = "none" if best is None else choice if best is row else f"{best.knob}: {best.setting}"
    fast = own or isnan(seconds) or row.seconds <= SLOWER * seconds
    note = "set in the recipe" if own else ""
    return Verdict(
        row.stage, choice, row.error, row.unit, row.allowed, row.seconds, name, seconds, row.meets and fast, note
    )


def _whole(errors: Sequence[Point], walked: dict[str, list[Point]], other_seconds: float, own: set[str]) -> Verdict:
    """Of all settings together: signals by every pair of a tracing and a synthesis, image, range. errors: first those
    of the whole frame, then of stages that it has none of."""
    best_signals, names = _signals(walked["trace"], walked["synthesis"])
    seconds = other_seconds + best_signals
    for stage in ("image", "range"):
        best = None if stage in own else cheapest(walked[stage])
        best = best or next((p for p in walked[stage] if p.chosen), None)
        if best is not None:
            seconds += best.seconds
            names.append(best.setting)
    worst = max(errors, key=lambda p: inf if isnan(p.error) else p.error / p.allowed)
    spent = errors[0].seconds
    broken = [p.stage if p.stage != "frame" else p.knob for p in errors if not p.meets]
    note = "; ".join(
        [*(f"{knob} beyond what is allowed" for knob in broken), *(["partly set in the recipe"] if own else [])]
    )
    return Verdict(
        "frame",
        "the plan",
        worst.error,
        worst.unit,
        worst.allowed,
        spent,
        ", ".join(names),
        seconds,
        not broken and spent <= SLOWER * seconds,
        note,
    )


def _signals(traces: Sequence[Point], syntheses: Sequence[Point]) -> tuple[float, list[str]]:
    """Seconds of the cheapest pair of a tracing and a synthesis that keeps within the accuracy, and their names."""
    usual = next((p.seconds for p in syntheses if p.chosen), 0.0)
    pairs = []
    for trace in traces:
        for synthesis in syntheses if usual > 0.0 else ():
            if hypot(trace.error, synthesis.error) <= trace.allowed:
                seconds = trace.also["trace_s"] + trace.also["synthesis_s"] * synthesis.seconds / usual
                pairs.append((seconds, [f"{trace.knob} {trace.setting}", synthesis.setting]))
    if pairs:
        return min(pairs, key=lambda pair: pair[0])
    return next((p.seconds for p in traces if p.chosen), 0.0), ["no signals of this walk"]
