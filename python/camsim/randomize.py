"""Random scenarios: values that are drawn, as `[randomize]` of a scenario file."""

from __future__ import annotations

import json
import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, SupportsIndex, overload

from ._errors import InputError

if TYPE_CHECKING:
    from .scenario import Scenario

Numbers = float | Sequence[float]
"""A number, or one for each element of a list."""


class Distribution:
    """How a value is drawn; `docs/guide/RANDOMIZE.md` describes all of them."""

    def to_dict(self) -> dict[str, Any]:
        """The distribution as a scenario file has it."""
        raise NotImplementedError


@dataclass(frozen=True)
class Uniform(Distribution):
    """Any number from `low` to `high`, equally likely.

    >>> camsim.Uniform(2, 10).to_dict()
    {'uniform': [2, 10]}
    """

    low: Numbers
    high: Numbers

    def to_dict(self) -> dict[str, Any]:
        return {"uniform": [self.low, self.high]}


@dataclass(frozen=True)
class LogUniform(Distribution):
    """Equally likely by logarithm: as many from 1 to 10 as from 10 to 100."""

    low: Numbers
    high: Numbers

    def to_dict(self) -> dict[str, Any]:
        return {"log_uniform": [self.low, self.high]}


@dataclass(frozen=True)
class Normal(Distribution):
    """A normal number; values beyond `clip` do not occur, and none heap up at its ends."""

    mean: Numbers
    sigma: Numbers
    clip: tuple[Numbers, Numbers] | None = None

    def to_dict(self) -> dict[str, Any]:
        clip = {} if self.clip is None else {"clip": list(self.clip)}
        return {"normal": [self.mean, self.sigma], **clip}


@dataclass(frozen=True)
class Integer(Distribution):
    """A whole number from `low` to `high`, both included."""

    low: int | Sequence[int]
    high: int | Sequence[int]

    def to_dict(self) -> dict[str, Any]:
        return {"integer": [self.low, self.high]}


@dataclass(frozen=True)
class Choice(Distribution):
    """One of some values: numbers, words, paths, lists or whole tables; `weights` says how often."""

    values: Sequence[Any]
    weights: Sequence[float] | None = None

    def to_dict(self) -> dict[str, Any]:
        weights = {} if self.weights is None else {"weights": list(self.weights)}
        return {"choice": list(self.values), **weights}


@dataclass(frozen=True)
class Times(Distribution):
    """The value that the scenario has, times a drawn number."""

    by: Distribution

    def to_dict(self) -> dict[str, Any]:
        return {"times": self.by.to_dict()}


@dataclass(frozen=True)
class Plus(Distribution):
    """The value that the scenario has, plus a drawn number."""

    by: Distribution

    def to_dict(self) -> dict[str, Any]:
        return {"plus": self.by.to_dict()}


@dataclass(frozen=True)
class Piece(Distribution):
    """For `flight.window_s`: a piece of this length from anywhere in the window that the scenario states."""

    length_s: float

    def to_dict(self) -> dict[str, Any]:
        return {"piece_s": self.length_s}


_CHECKED = 10_000
"""Variations that iteration checks before it gives the first."""


class Variations(Sequence["Scenario"]):
    """The scenarios that `[randomize]` describes, by number. Any of them can be made at any time, in any process.

    Iteration checks all of them before it gives the first, of more than 10 000 the first 10 000; `check` checks others.

    >>> variations = camsim.randomize(scenario, {"camera.shutter.exposure_ms": camsim.Uniform(2, 10)}, seed=7)
    >>> variations[17][0].color
    >>> variations.drawn(17)
    {'camera.shutter.exposure_ms': 6.95500452456, 'seed': 74442395611743}
    """

    def __init__(self, scenario: Scenario) -> None:
        """Those of a scenario that has `[randomize]`."""
        if not scenario._native.is_random:
            raise InputError("the scenario has no [randomize], so it has no variations: use camsim.randomize")
        self.scenario = scenario

    def __len__(self) -> int:
        """`randomize.variations`, or `count` of `camsim.randomize`."""
        count = self.scenario._native.variations
        if count is None:
            raise TypeError("variations have no number: give camsim.randomize a count, or state randomize.variations")
        return count

    @overload
    def __getitem__(self, index: SupportsIndex) -> Scenario: ...
    @overload
    def __getitem__(self, index: slice) -> list[Scenario]: ...
    def __getitem__(self, index: SupportsIndex | slice) -> Scenario | list[Scenario]:
        """Variation `index`; what it does not change (log, scene) is shared with the others.

        :raises camsim.InputError: A drawn value is out of range; the message has number, key and value.
        """
        if isinstance(index, slice):
            return [self.scenario._variation(number) for number in range(len(self))[index]]
        return self.scenario._variation(self._number(index))

    def __iter__(self) -> Iterator[Scenario]:
        self.check(0, min(len(self), _CHECKED))
        return (self.scenario._variation(number) for number in range(len(self)))

    def check(self, start: int = 0, stop: int | None = None) -> None:
        """Checks variations from `start` to before `stop`, all if omitted. Nothing is loaded or rendered: some
        thousands take a second.

        :raises camsim.InputError: A drawn value is out of range; the message has number, key and value.

        >>> variations.check()
        """
        native = self.scenario._native
        is_endless = native.variations is None and stop is not None
        numbers = range(start, stop or 0) if is_endless else range(len(self))[start:stop]
        if len(numbers):
            native.check_variations(numbers.start, numbers.stop)

    def drawn(self, index: SupportsIndex) -> dict[str, Any]:
        """What variation `index` draws, by key; nothing is loaded."""
        values: dict[str, Any] = json.loads(self.scenario._native.drawn(self._number(index)))
        return values

    def _number(self, index: SupportsIndex) -> int:
        try:
            number, count = operator.index(index), self.scenario._native.variations
        except TypeError:
            raise TypeError(f"variations are numbered by whole numbers, not {type(index).__name__}") from None
        if count is not None:
            if not -count <= number < count:
                raise IndexError(f"variation {number}: there are {count} variations")
            return number % count
        if number < 0:
            raise IndexError("variations without a count have no end to count from")
        if number >= 2**63:
            raise IndexError(f"variation {number}: variations have numbers of 63 bits")
        return number

    def __repr__(self) -> str:
        count = self.scenario._native.variations
        return f"<camsim.Variations: {'any number' if count is None else count} of {self.scenario!r}>"

    __eq__ = object.__eq__
    __hash__ = object.__hash__


def randomize(
    scenario: Scenario,
    laws: Mapping[str, Distribution | Mapping[str, Any]],
    seed: int | None = None,
    *,
    count: int | None = None,
    own_seed: bool = True,
) -> Variations:
    """Scenarios with drawn values. A value is a function of the seed, its key and the number of the variation alone.

    :param scenario: The scenario whose keys are drawn, on top of those that its own `[randomize]` draws.
    :param laws: Keys with distributions: objects, or tables as in a file, ``{"uniform": [2, 10]}``.
    :param seed: Of the draws; the scenario's if omitted.
    :param count: How many variations there are; any number if omitted.
    :param own_seed: Give each variation a seed of its own, so that its noise differs.
    :raises camsim.InputError: A key or a distribution does not fit. Drawn values are checked by `Variations.check`, which
        iteration begins with.

    >>> variations = camsim.randomize(
    ...     scenario,
    ...     {"camera.shutter.exposure_ms": camsim.Uniform(2, 10), "camera.mount.angles_deg.2": camsim.Uniform(0, 360)},
    ...     seed=7,
    ...     count=1000,
    ... )
    """
    if not isinstance(laws, Mapping):
        raise TypeError(f'laws: a dict is needed, {{"camera.fps": camsim.Uniform(10, 30)}}, not {type(laws).__name__}')
    sets: dict[str, Any] = {
        f"randomize.{key}": law.to_dict() if isinstance(law, Distribution) else law for key, law in laws.items()
    }
    sets["randomize.own_seed"] = own_seed
    if seed is not None:
        sets["randomize.seed"] = seed
    if count is not None:
        sets["randomize.variations"] = count
    return Variations(scenario.replace(sets))
