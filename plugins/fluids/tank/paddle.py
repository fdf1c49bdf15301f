"""Motion of a wave maker: linear wave-maker theory, and Goring's solitary wave."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.environment.linear_waves import flap_gain, jonswap, piston_gain, wavenumber
from seals.errors import ConfigError
from seals.plugins.fluids.tank.settings import Maker, MakerSettings, SeaState

STEEPEST = 0.3
"""Steepness k a above which linear wave-maker theory is not valid [1]."""
SHALLOWEST = 0.7
"""Largest solitary wave over depth; at 0.78 it breaks [1]."""
_TAIL = 3.8
"""Half width of a solitary wave's maker motion, as the argument of sech^2."""


class Stroke(NamedTuple):
    """Displacement of the paddle at the still surface [m] and its rate [m/s]."""

    place: float
    speed: float


class Paddle:
    """Wave maker paddle in water of a given depth.

    Args:
        settings: of the maker.
        depth: of the still water [m].
        gravity: [m/s^2].

    Raises:
        ConfigError: the waves are too steep or too high for the theory.
    """

    def __init__(self, settings: MakerSettings, *, depth: float, gravity: float) -> None:
        self.settings, self.depth, self.gravity = settings, depth, gravity
        self._solitary = settings.sea is SeaState.solitary
        if self._solitary:
            self._omega = self._stroke = self._phase = np.zeros(0)
            high = self.settings.height / self.depth
            if not 0.0 < high <= SHALLOWEST:
                raise ConfigError(
                    f"maker: a solitary wave of {self.settings.height:g} m on {self.depth:.3g} m "
                    f"of water is {high:.2f} of the depth.\n"
                    f"Allowed: above 0, up to {SHALLOWEST:g}; it breaks at 0.78."
                )
            self.length = 2.0 * _TAIL * self.depth / math.sqrt(0.75 * high)
        else:
            self._components()

    def _components(self) -> None:
        s = self.settings
        if s.sea is SeaState.jonswap:
            self._omega, amplitude = jonswap(
                s.height, s.period, peakedness=s.peakedness, components=s.components
            )
            self._phase = np.random.default_rng(s.seed).uniform(0.0, 2.0 * math.pi, s.components)
        else:
            self._omega, amplitude = np.array([2.0 * math.pi / s.period]), np.array([s.height / 2])
            self._phase = np.zeros(1)
        k = np.array([wavenumber(w, self.depth, self.gravity) for w in self._omega])
        gain = flap_gain if s.kind is Maker.flap else piston_gain
        self._stroke = amplitude / np.array([gain(x) for x in k * self.depth])
        peak = wavenumber(2.0 * math.pi / s.period, self.depth, self.gravity)
        self.length = 2.0 * math.pi / peak
        steep = 0.5 * peak * s.height
        if steep > STEEPEST:
            raise ConfigError(
                f"maker: a height of {s.height:g} m at {s.period:g} s on {self.depth:.3g} m of "
                f"water has the steepness {steep:.2f}.\nAllowed: up to {STEEPEST:g}, that is "
                f"{2.0 * STEEPEST / peak:.3g} m; lower the height or raise the period."
            )

    @property
    def travel(self) -> float:
        """Largest displacement of the paddle at the still surface to either side [m]."""
        if self._solitary:
            return 2.0 * math.sqrt(self.settings.height * self.depth / 0.75)
        if len(self._stroke) == 1:
            return float(self._stroke[0])
        # three standard deviations and a little more
        return float(3.5 * math.sqrt(0.5 * (self._stroke**2).sum()))

    def stroke(self, time: float) -> Stroke:
        """Return displacement and rate at ``time`` [s]; negative is away from the water."""
        t = time - self.settings.start
        if t <= 0.0:
            return Stroke(0.0, 0.0)
        if self._solitary:
            return self._goring(t)
        angle = self._omega * t + self._phase
        # amplitude of the displacement is half the stroke, and amplitude/gain is just that
        place = float(self._stroke @ np.sin(angle))
        speed = float((self._stroke * self._omega) @ np.cos(angle))
        # an irregular sea does not begin at rest: it always comes up
        least = 1.0 if len(self._phase) > 1 else 0.0
        # multiply a motion by a smooth start-up ramp
        ramp = max(self.settings.ramp, least) * self.settings.period
        if ramp <= 0.0 or t >= ramp:
            return Stroke(place, speed)
        u = t / ramp
        share, rate = u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / ramp
        return Stroke(share * place, share * speed + rate * place)

    def _goring(self, t: float) -> Stroke:
        """Goring 1978: the paddle moves with the water's mean velocity, dX/dt = c eta/(h + eta)."""
        h, high = self.depth, self.settings.height
        k, c = math.sqrt(0.75 * high / h**3), math.sqrt(self.gravity * (h + high))
        # the crest passes the paddle once its motion is half done
        middle = (_TAIL + high / h) / (k * c)
        place = self._solved(k, c, t - middle, h, high)
        eta = high / math.cosh(k * (c * (t - middle) - place)) ** 2
        start = self._solved(k, c, -middle, h, high)
        return Stroke(place - start, c * eta / (h + eta))

    @staticmethod
    def _solved(k: float, c: float, t: float, h: float, high: float) -> float:
        """X of X = (H / k h) tanh(k (c t - X)), by Newton's method."""
        place = 0.0
        for _ in range(50):
            tanh = math.tanh(k * (c * t - place))
            error = place - high / (k * h) * tanh
            change = error / (1.0 + high / h * (1.0 - tanh * tanh))
            place -= change
            if abs(change) < 1e-14:
                break
        return place


class PaddlePlate(NamedTuple):
    """Pose and twist of the paddle: position (3,), rotation (3, 3), velocities (3,) each."""

    position: Floats
    rotation: Floats
    velocity: Floats
    spin: Floats

    @classmethod
    def of(cls, kind: Maker, stroke: Stroke, foot: Floats, depth: float) -> PaddlePlate:
        """Return pose and twist of the paddle at a stroke.

        Args:
            kind: piston or flap.
            stroke: at the still surface.
            foot: lower edge of the paddle at rest, world [m], shape (3,).
            depth: of the still water [m].
        """
        still = np.zeros(3)
        if kind is not Maker.flap:
            push = np.array([stroke.place, 0.0, 0.0])
            return cls(foot + push, np.eye(3), np.array([stroke.speed, 0.0, 0.0]), still)
        tangent = stroke.place / depth
        angle = math.atan(tangent)
        rate = stroke.speed / depth / (1.0 + tangent * tangent)
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        return cls(foot.copy(), turn, still, np.array([0.0, rate, 0.0]))
