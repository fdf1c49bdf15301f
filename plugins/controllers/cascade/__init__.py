"""Cascade controller: velocity PID over attitude control, in air, at the surface and in water."""

from seals.plugins.controllers.cascade.controller import Cascade as Cascade
