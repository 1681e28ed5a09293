"""`tools/bench laws`: one frame of remus.yaml by each law of scattering, and what the shapes of its pulses cost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import sonarsynth as ss
from benchmarks.timing import RECIPE, cpu, markdown
from sonarsynth import pipeline, planning
from sonarsynth.pipeline import TracedFrame
from sonarsynth.planning import Plan
from sonarsynth.planning.measured.sampled_arrivals import reception_of
from sonarsynth.products import Arrivals, Signals
from sonarsynth.recipe import reading
from sonarsynth.signals import DirectSum

LAWS = {
    "lobe": ss.MirrorLobe(),
    "Kirchhoff": ss.Kirchhoff(),
    "rough, 2 mm": ss.Kirchhoff(roughness=0.002, slope=0.2),
    "rough, 20 mm": ss.Kirchhoff(roughness=0.02, slope=0.2),
}
FRAMES = 7
HEARD = (253,)
"""Hydrophones that the slow exact way is asked at, beside the outmost."""


def plain(arrivals: Arrivals) -> Arrivals:
    """The same paths, each a scaled snap: what the pulses would be without their shapes."""
    none = np.zeros(len(arrivals.delay))
    return replace(
        arrivals,
        coherent=none.astype(bool),
        corner_delays=0.0 * arrivals.corner_delays,
        coherent_fraction=none,
        height_delay_std=none,
        delay_std=none,
        phase=none,
        expansion=arrivals.expansion.without("phase", "delay_variance"),
    )


def synthesise(plan: Plan, traced: TracedFrame) -> Signals:
    """What reaches the hydrophones: no noise, no converter."""
    reception = reception_of(plan, traced.frame)
    return plan.scene.physics.synthesis.signals(traced.arrivals, traced.frame.moment.snaps, reception)


def synthesis_ms(plan: Plan, index: int) -> tuple[float, float, float]:
    """Processor time (ms) of the synthesis of a frame not seen before, and of its paths without shapes; and the error
    over the echo's peak."""
    traced = pipeline.trace_frame(plan, index)
    echoes = replace(traced, arrivals=traced.arrivals.select(~traced.arrivals.direct))
    shaped: Signals = synthesise(plan, echoes)
    elements = plan.elements
    outmost = int(np.argmax(np.linalg.norm(elements.position, axis=1)))
    some = np.unique([outmost, *HEARD])
    few = elements.select(some)
    heard = echoes.arrivals.for_sensors(some, elements.count)
    exact, _ = DirectSum().pressure(
        heard, traced.frame.moment.snaps, reception_of(plan, traced.frame)._replace(elements=few)
    )
    times = []
    for make in (lambda a: a, plain):
        others = []
        for i in range(index + 1, index + 1 + FRAMES):
            frame = pipeline.trace_frame(plan, i)
            frame = replace(frame, arrivals=make(frame.arrivals))
            others.append(cpu(lambda frame=frame: synthesise(plan, frame), 1)[1])
        times.append(1e3 * float(np.median(others)))
    error = np.abs(shaped.pressure[some] - exact).max() / np.abs(exact).max()
    return times[0], times[1], float(error)


def bench(index: int = 20) -> dict[str, Any]:
    """Facets, paths, cost of tracing and of synthesis, error against direct sums."""
    recipe = reading.load(RECIPE, ("accuracy.signal=0.02",))  # the middle of the array sees for all
    rows = {}
    for name, law in LAWS.items():
        physics = replace(recipe.scene.physics, scattering=law)
        plan = planning.plan(replace(recipe, scene=replace(recipe.scene, physics=physics)))
        traced, tracing = cpu(lambda plan=plan: pipeline.trace_frame(plan, index))
        shaped, scaled, error = synthesis_ms(plan, index)
        rows[name] = {
            "facets": sum(len(mesh.faces) for mesh in plan.scene.meshes),
            "paths": len(traced.arrivals.delay),
            "trace_and_label_ms": 1e3 * tracing,
            "synthesise_ms": shaped,
            "synthesise_as_scaled_snaps_ms": scaled,
            "error_over_echo_peak": error,
        }
    return {"method": plan.scene.physics.synthesis.kind, "exact": DirectSum().kind, "laws": rows}


def table(result: dict[str, Any]) -> str:
    """A column for each law."""
    laws = result["laws"]
    rows = [("", *laws)]
    rows.append(("facets, paths", *(f"{law['facets']}, {law['paths']}" for law in laws.values())))
    rows.append(("trace and label, ms", *(f"{law['trace_and_label_ms']:.0f}" for law in laws.values())))
    synthesis = (f"{law['synthesise_ms']:.0f}; {law['synthesise_as_scaled_snaps_ms']:.0f}" for law in laws.values())
    rows.append(("synthesise, ms; the same paths as scaled snaps", *synthesis))
    errors = (f"{law['error_over_echo_peak']:.0e}" for law in laws.values())
    rows.append(("error of the signals against direct sums, of the echo's peak", *errors))
    return "\n".join(markdown(rows))
