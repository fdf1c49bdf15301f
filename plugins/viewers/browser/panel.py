"""Control panel of the page: time, forces, cameras, parameters of the run."""

from __future__ import annotations

import threading
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.drawn_text import in_markdown, readable
from seals.report.style import unit_text
from seals.view.session import Session

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4", "8")
"""Simulated seconds in one second of the clock."""


class Panel:
    """Control panel of one session.

    Values are read by the thread that draws; pages write them from threads of their own.

    Args:
        server: viser's.
        session: what is shown.
    """

    def __init__(self, server: Any, session: Session) -> None:
        self._gui, self._session = server.gui, session
        self._lock = threading.Lock()
        self._turned: dict[str, float] = {}
        self._told = 0.0
        gui = self._gui
        self._note = gui.add_markdown("")
        self.playing = gui.add_checkbox("play", True)
        self.time = gui.add_slider("time [s]", 0.0, 1.0, 0.001, 0.0)
        self.speed = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        self.follow = gui.add_checkbox(
            "follow the robot", False, hint="The view moves with the robot."
        )
        self.water = gui.add_checkbox("water", True)
        self._values = self._sliders() if session.sliders else None
        self._forces: Any = None
        self._cameras: Any = None
        self.effects: dict[str, Any] = {}
        self.stretch: Any = None
        self._images: dict[str, Any] = {}

    def _sliders(self) -> Any:
        folder = self._gui.add_folder("Parameters (a change starts a new run)")
        with folder:
            for s in self._session.sliders:
                label = s.key.removeprefix("effects.") + (
                    f" [{unit_text(s.unit)}]" if s.unit else ""
                )
                handle = self._gui.add_slider(label, s.low, s.high, s.step, s.value)
                handle.on_update(self._turn(s.key))
        return folder

    def _turn(self, key: str) -> Any:
        def turned(event: Any) -> None:
            if event.client is not None:
                with self._lock:
                    self._turned[key] = float(event.target.value)

        return turned

    def grabbed(self) -> float | None:
        """Return the time chosen by the user since the last call of `tell` [s], or None."""
        value = float(self.time.value)
        if value == self._told:
            return None
        # a time on its way to the page may have met the chosen one: `tell` says it once more
        aside = self.time.step if value < self.time.step else -self.time.step
        self._told = self.time.value = value + aside
        return value

    def turned(self) -> dict[str, float]:
        """Return the parameters that the user changed since the last call."""
        with self._lock:
            found, self._turned = self._turned, {}
        return found

    def begin(self, colours: dict[str, tuple[int, int, int]]) -> None:
        """Rebuild the controls for the displayed run."""
        for folder in (self._forces, self._cameras):
            if folder is not None:
                folder.remove()
        gui, off = self._gui, {n for n, box in self.effects.items() if not box.value}
        self._forces = self._cameras = None
        self.effects, self._images = {}, {}
        if self._session.shots.cameras:
            self._cameras = gui.add_folder("Cameras")
            black = np.zeros((8, 8, 3), dtype=np.uint8)
            with self._cameras:
                self._images = {
                    name: gui.add_image(black, label=name) for name in self._session.shots.cameras
                }
        if colours:
            self._forces = gui.add_folder("Forces")
            with self._forces:
                self.stretch = gui.add_slider("length", 0.1, 5.0, 0.1, 1.0)
                spans = (
                    f'<span style="color: rgb{colour}; white-space: nowrap">&#9632; {name}</span>'
                    for name, colour in ((escape(readable(k)), v) for k, v in colours.items())
                )
                style = "padding: 0 0.75em; font-size: 0.8em"
                gui.add_html(f'<div style="{style}">{"&ensp; ".join(spans)}</div>')
                self.effects = {n: gui.add_checkbox(n, n not in off) for n in colours}

    def chosen(self) -> set[str]:
        """Return the effects whose arrows are switched on."""
        return {name for name, box in self.effects.items() if box.value}

    def tell(self, time: float) -> None:
        """Show the time [s] and a status text."""
        length = max(self._session.length, 1e-3)
        if abs(self.time.max - length) > 1e-9:
            self.time.max = length
        if self.time.value == self._told and abs(time - self._told) > 1e-9:
            self._told = self.time.value = min(time, length)
        words = f"t = {time:.3f} s\n\n{in_markdown(self._session.note)}"
        if self._note.content != words:
            self._note.content = words

    def picture(self, camera: str, image: NDArray[np.uint8]) -> None:
        """Show the picture of a camera."""
        self._images[camera].image = image
