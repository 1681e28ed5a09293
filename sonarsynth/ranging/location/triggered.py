"""Emissions that the sonar is told of, as of its own transmitter: when and where is known, not measured."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from sonarsynth.conventions import PositiveMetres, PositiveSeconds, depth
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize
from sonarsynth.environment.sound_speed import mean_gradient
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.location.locating_method import LocatingMethod
from sonarsynth.state import Emission, Receiver, Survey, Trigger


@description
class Triggered(LocatingMethod):
    """Time and place of each emission as its trigger tells them, to a stated accuracy; the direct sound is taken to
    come straight from there at the assumed sound speed, and its predicted angle holds what a gradient g of the sound
    speed may do to that, r g/(2c). So a source may be among the hydrophones, as a ping is."""

    kind: Literal["trigger"] = "trigger"
    time_error: PositiveSeconds = 1e-6
    """Standard error of the time that the sonar is told."""
    position_error: PositiveMetres = 0.01
    """Standard error of each coordinate of the place that it is told."""

    def told(self, snaps: tuple[Emission, ...], receiver: Receiver, random: np.random.Generator) -> tuple[Trigger, ...]:
        """As `LocatingMethod.told`: with errors that are drawn."""
        from sonarsynth.signals.filtered_pulse import envelope_delay, snap_levels

        off, late = random.standard_normal((len(snaps), 4)), [envelope_delay(s.waveform, receiver.sonar) for s in snaps]
        away = np.array([np.linalg.norm(s.position - receiver.pose.position) for s in snaps])
        loudest = np.argsort(20.0 * np.log10(away) - snap_levels(snaps), kind="stable").tolist()
        return tuple(
            Trigger(
                snaps[n].time + late[n] + self.time_error * float(off[n, 3]),
                snaps[n].position + self.position_error * off[n, :3],
            )
            for n in loudest
        )

    def locate(self, signals: Signals, receiver: Receiver, survey: Survey, snaps: int) -> SourceEstimates:
        """As `LocatingMethod.locate`: what it was told, as far as it is in the water."""
        from sonarsynth.ranging.location.candidates import as_estimates
        from sonarsynth.ranging.location.source_position import ACCEPTED, refused

        rows, c, error = [], receiver.sonar.assumed_sound_speed, self.position_error
        sonar_depth = float(depth(receiver.pose.position))
        for trigger in survey.triggers:
            own = receiver.pose.to_body(trigger.position)
            if (track := receiver.track) is not None and not track.still:  # it goes on until the sound arrives
                for _ in range(3):
                    own = track.later(trigger.time + float(np.linalg.norm(own)) / c).pose.to_body(trigger.position)
            r = float(np.linalg.norm(own))
            source_depth = float(depth(trigger.position))
            gradient = mean_gradient(survey.profile, sonar_depth, source_depth, receiver.elements.aperture or 1.0)
            turned = min(float(np.hypot(error / r, 0.5 * r * gradient / c)), np.pi)
            delay_error = np.hypot(error / c, r * receiver.sonar.sound_speed_error / c**2)
            fix = replace(
                refused(ACCEPTED),
                time=trigger.time + r / c,
                time_error=float(np.hypot(self.time_error, delay_error)),
                direction=own / r,
                angle_error=np.array([min(turned / max(np.hypot(own[0], own[1]) / r, 1e-9), np.pi), turned]),
                position=own,
                covariance=error**2 * np.eye(3),
                by_speed=np.zeros(3),
                bottom_used=0,
            )
            rows.append(fix)
        return as_estimates(rows, snaps)

    def row(self) -> str:
        """As `Method.row`."""
        return f"trigger, to {1e6 * self.time_error:.3g} us and {self.position_error:.3g} m"

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: nothing is measured."""
        return 1e-4
