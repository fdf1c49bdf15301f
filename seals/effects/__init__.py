"""Physical effects: the base class of their plug-ins, and their binding to the links of a robot."""

from seals.effects.binding import BoundEffect as BoundEffect
from seals.effects.binding import EffectSet as EffectSet
from seals.effects.binding import bind_effects as bind_effects
from seals.effects.effect import Effect as Effect
from seals.effects.effect import MediumKind as MediumKind
from seals.effects.identification import Addition as Addition
from seals.effects.identification import Comparison as Comparison
from seals.effects.identification import Freed as Freed
from seals.effects.identification import Identification as Identification
from seals.effects.identification import Property as Property
from seals.effects.identification import Residual as Residual
from seals.effects.identification import Stage as Stage
from seals.effects.identification import Subject as Subject
from seals.effects.identification import addition_along_axes as addition_along_axes
from seals.effects.identification import along_axes as along_axes
