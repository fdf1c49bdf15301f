"""Viewer in the browser: draw loop and controls."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import SealsError
from seals.picture_files import read_picture
from seals.plugins.viewers.browser.arrows import Pushes
from seals.plugins.viewers.browser.panel import Panel
from seals.plugins.viewers.browser.sea import Sea
from seals.plugins.viewers.browser.server import open_server
from seals.plugins.viewers.browser.solids import Solids
from seals.plugins.viewers.browser.surroundings import Extent, look_at, set_sky
from seals.rendering.scene import Poses
from seals.schema import setting
from seals.view.session import Session

REST = 0.5
"""Time a slider rests before the run starts anew [s]: nobody wants a run for every pixel."""


@dataclass(kw_only=True)
class ViewerBrowser:
    """Viewer in the web browser, by viser.

    Args:
        rate: pictures in a second.
        opacity: of the water surface.
    """

    rate: float = setting(20.0, "Hz", bounds=(1.0, 60.0), source="chosen: a forwarded port")
    opacity: float = setting(0.55, "1", bounds=(0.05, 1.0), source="chosen: robots show below")

    def show(self, session: Session, *, host: str, port: int) -> None:
        """Show a session until it is interrupted."""
        server = open_server(host, port)
        try:
            page = _Page(server, session, self.opacity)
            print(f"seals view: {server.address}  (Ctrl-C ends it)", flush=True)
            while True:
                began = time.perf_counter()
                page.draw()
                time.sleep(max(0.005, 1.0 / self.rate - (time.perf_counter() - began)))
        finally:
            server.stop()


class _Page:
    """Contents of the page and the displayed time.

    Args:
        server: viser's.
        session: what there is to see.
        opacity: of the water surface [1].
    """

    def __init__(self, server: Any, session: Session, opacity: float) -> None:
        self._server, self._session, self._opacity = server, session, opacity
        self.panel = Panel(server, session)
        self.now = 0.0
        self._clock = time.perf_counter()
        self._shown = -1
        self._parts: list[Any] = []
        self._extent: Extent | None = None
        self._pending: dict[str, float] = {}
        self._changed = 0.0
        self._pictures: dict[str, Path | None] = {}
        self._base: Floats | None = None
        self._sent: tuple[Any, ...] = ()
        set_sky(server)

    def draw(self) -> None:
        """Apply the controls, advance the time, and draw."""
        session = self._session
        self._obey()
        session.follow()
        self._pass()
        poses = session.poses(self.now)
        if session.shown != self._shown and poses is not None:
            self._build()
            poses = session.poses(self.now)
        if poses is None:
            self.panel.tell(self.now)
            return
        self._draw(poses)
        self._follow(np.asarray(poses.position[0, 0]))
        for camera in self._session.shots.cameras:
            file = self._session.shots.last(camera, self.now)
            if file is not None and self._pictures.get(camera) != file:
                self._pictures[camera] = file
                self.panel.picture(camera, read_picture(file))
        self.panel.tell(self.now)
        self._server.flush()

    def _draw(self, poses: Poses) -> None:
        """Send what has changed since the last picture."""
        wanted = self.panel.chosen()
        stretch = self.panel.stretch.value if wanted else 1.0
        state = (self._shown, self.now, self.panel.water.value, frozenset(wanted), stretch)
        if state == self._sent:
            return
        self._sent, session = state, self._session
        solids, sea, pushes = self._parts
        with self._server.atomic():
            solids.place(poses)
            if self.panel.water.value:
                sea.show(self.now, session.particles(self.now))
            else:
                sea.remove()
            arrows = session.forces.at(self.now, poses) if wanted else {}
            pushes.show({n: a for n, a in arrows.items() if n in wanted}, stretch)

    def _obey(self) -> None:
        """Jump to the chosen time, and restart a run once its sliders have stopped moving."""
        chosen = self.panel.grabbed()
        if chosen is not None:
            self.now, self.panel.playing.value = chosen, False
        turned = self.panel.turned()
        if turned:
            self._pending |= turned
            self._changed = time.perf_counter()
        if self._pending and time.perf_counter() - self._changed > REST:
            changes, self._pending = self._pending, {}
            try:
                self._session.turn(changes)
            except SealsError as refusal:
                self._session.note = " ".join(str(refusal).split())
                return
            self.now, self.panel.playing.value = 0.0, True

    def _pass(self) -> None:
        """Advance the displayed time."""
        clock = time.perf_counter()
        passed, self._clock = clock - self._clock, clock
        if self.panel.playing.value:
            self.now += passed * float(self.panel.speed.value)
        end = self._session.end
        if self.now > end:
            # a run that goes on is waited for, one that has ended begins again
            again = self.panel.playing.value and self._session.live is None and end > 0.0
            # not at exactly 0: a person who chose that very time would not be noticed
            self.now = self.now % end if again else end

    def _build(self) -> None:
        """Build the displayed run in the page."""
        session = self._session
        for part in self._parts:
            part.remove()
        first = self._extent is None
        extent = self._extent = Extent.of(session, self._extent)
        self._parts = [
            Solids(self._server, session.stage, extent.middle, extent.half),
            Sea(self._server, session.water, extent.middle, extent.half, self._opacity),
            Pushes(self._server, session.forces, extent.arrow),
        ]
        self.panel.begin(self._parts[2].colours)
        self._shown, self._pictures = session.shown, {}
        if first:
            look_at(self._server, extent)
            self.panel.follow.value = extent.far

    def _follow(self, base: Floats) -> None:
        """Move the views with the robot, where that is wanted."""
        before, self._base = self._base, base
        if before is None or not self.panel.follow.value:
            return
        for client in self._server.get_clients().values():
            # the point looked at goes along
            client.camera.position = client.camera.position + (base - before)
