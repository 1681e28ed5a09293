"""Splits: which sequences are for training, validation and test."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le
from pydantic import model_validator

from sonarsynth.conventions import Ints, Number
from sonarsynth.description import description
from sonarsynth.recipe.variation.values import Name

_Share = Annotated[Number, Ge(0), Le(1)]


@description
class Splits:
    """Shares of the sequences for training, validation and test. A sequence is never divided, nor are sequences whose
    scene is the same, but for its number of frames. Those of which populations are drawn are not the same.
    """

    train: _Share = 0.0
    """Share of the sequences."""
    validation: _Share = 0.0
    """Share of the sequences."""
    test: _Share = 0.0
    """Share of the sequences; the three add up to 1."""
    stratify: Name | None = None
    """Name of an entry of the grid, or of a choice: each of its values is divided in these shares."""
    undivided: tuple[Name, ...] = ()
    """Names of entries of the grid, or of choices: sequences that have the same values of all these stay together."""

    @model_validator(mode="after")
    def _check(self) -> Splits:
        total = self.train + self.validation + self.test
        if abs(total - 1.0) > 1e-9:
            raise ValueError(f"train, validation and test must add up to 1, not {total:.12g}")
        return self

    @property
    def shares(self) -> tuple[float, ...]:
        """Shares in the order of SPLITS."""
        return (self.train, self.validation, self.test)


def assign(
    shares: Sequence[float], groups: Sequence[Hashable], strata: Sequence[Hashable], priority: Sequence[int]
) -> Ints:
    """Split (sequence,) of each sequence: an index into `shares`.

    Groups (those of equal `groups`) go in the order of stratum and priority, each to the split that would be late next
    (Tijdeman, 1980, The chairman assignment problem): of the first n sequences in that order, each split has less than
    one too many or too few. So the splits are exact to rounding, and those of a stratum within two, where groups are
    single sequences; otherwise as near as the groups allow.
    """
    members: dict[Hashable, list[int]] = {}
    for number, group in enumerate(groups):
        members.setdefault(group, []).append(number)
    order = _strata_in_order(strata)
    ranked = sorted(members.values(), key=lambda rows: (order[strata[rows[0]]], min(priority[n] for n in rows)))
    used = [i for i, share in enumerate(shares) if share > 0.0]
    slack = 1.0 / (2 * len(used) - 2) if len(used) > 1 else 0.0
    split, taken, passed = np.zeros(len(groups), np.int64), dict.fromkeys(used, 0), 0
    for rows in ranked:
        passed += len(rows)
        late = {i: shares[i] * passed - taken[i] for i in used}
        ready = [i for i in used if late[i] >= slack] or [max(used, key=lambda i: late[i])]
        chosen = min(ready, key=lambda i: (1.0 - slack - late[i]) / shares[i])
        split[rows] = chosen
        taken[chosen] += len(rows)
    return split


def _strata_in_order(strata: Sequence[Hashable]) -> dict[Hashable, int]:
    """Number of each stratum, by first appearance."""
    order: dict[Hashable, int] = {}
    for stratum in strata:
        order.setdefault(stratum, len(order))
    return order
