"""Guards of what peers send over a network, and of counts that are too many together."""

from __future__ import annotations

from benchmarks.guard import Guard

PEERS, COUNTS = "tests/unit/test_hostile_peers.py", "tests/unit/test_hostile_counts.py"
PILOTS = "tests/unit/test_hostile_autopilots.py"
_GATE, _ARDU = "seals.plugins.live.gate", "seals.teleop.autopilot.ardupilot"
_PX4 = "seals.teleop.autopilot.px4"
NETWORK: dict[str, Guard] = {
    "silence of an autopilot": Guard(
        _ARDU, "while (found := self._heard(end)) is not None:",
        "while (found := self._heard(time.monotonic() + self._timeout)) is not None:",
        PILOTS, "session_alive",
    ),
    "place of an autopilot": Guard(
        _ARDU, "            if peer != self._peer:\n", "            if peer is None:\n",
        PILOTS, "take_over or flood_of_autopilots",
    ),
    "address of an autopilot": Guard(
        _ARDU, "if not admitted(peer[0], self._allowed) or not peer[1]:", "if not peer[1]:",
        PILOTS, "out_of_private",
    ),
    "port of an autopilot": Guard(
        _ARDU, "self._allowed) or not peer[1]:", "self._allowed):", PILOTS, "first_autopilot_alone"
    ),
    "answers to repeated frames": Guard(
        _ARDU, "if self._again <= MOST_AGAIN:", "if True:", PILOTS, "repeated_frames"
    ),
    "answers that cannot leave": Guard(
        _ARDU, "except OSError as error:  # it may", "except ZeroDivisionError as error:  # it may",
        PILOTS, "cannot_leave",
    ),
    "address of PX4": Guard(
        _PX4, "if not admitted(peer[0], self._allowed):", "if False:", PILOTS, "told_address",
        "pymavlink",
    ),
    "pages before PX4": Guard(
        _PX4, "if self._foreign(wire):", "if False:", PILOTS, "web_page_flies", "pymavlink"
    ),
    "pages that wait before PX4": Guard(
        _PX4, "if not self._spoken and raw[:3] in BROWSERS:", "if False:", PILOTS, "that_waits",
        "pymavlink",
    ),
    "silence of PX4": Guard(
        _PX4, "if self.frames or time.monotonic() > self._begin + self._timeout:",
        "if self.frames:", PILOTS, "mute", "pymavlink",
    ),
    "origin of a listener": Guard(
        _GATE, "if len(pages) > 1 or (web and pages[0].lower() not in origins):", "if False:",
        PEERS, "gate_asks or pages_not or foreign_page",
    ),
    "pages without an origin": Guard(
        _GATE, 'pages[0] == "null" or ', "", PEERS, "gate_asks"
    ),
    "name asked by a listener": Guard(
        _GATE, "if len(hosts) != 1 or not names_this_machine(hosts[0], listened):", "if False:",
        PEERS, "gate_asks",
    ),
    "headers of a listener": Guard(
        _GATE, ' or any(not n.replace("-", "").isalnum() for n in fields)', "", PEERS, "gate_asks"
    ),
    "refusal of a listener": Guard(
        _GATE, "        if why:\n", "        if False:\n", PEERS, "pages_not"
    ),
    "flood of a listener": Guard(
        _GATE, "if most is not None and count > most:", "if False:", PEERS, "no_flood"
    ),
    "crowd of listeners": Guard(
        _GATE, "if task is None or len(self._tasks) >= MOST_CONNECTIONS:", "if task is None:",
        PEERS, "no_crowd",
    ),
    "silence of a listener": Guard(
        _GATE, "reader.readuntil(b\"\\r\\n\\r\\n\"), PATIENCE)",
        "reader.readuntil(b\"\\r\\n\\r\\n\"), 600)", PEERS, "waits_for_nobody",
    ),
    "door of Foxglove": Guard(
        "seals.plugins.live.foxglove", "self._gate.open(self._inner, self._server.port)",
        "self._gate.port = self._server.port", PEERS, "foreign_page", "foxglove",
    ),
    "speed of a command": Guard(
        "seals.plugins.live.ros2", "if not np.all(np.abs(values) < FASTEST):",
        "if not np.all(np.isfinite(values)):", PEERS, "absurd_velocity",
    ),
    "turns of a heading": Guard(
        "seals.plugins.live.ros2", "self._yaw = math.remainder(", "self._yaw = max(", PEERS,
        "one_turn",
    ),
    "declarations of others": Guard(
        "seals.plugins.live.ros2", '        "access_control": _access(taken, published),\n',
        "", PEERS, "others_declare or commands_alone", "zenoh",
    ),
    "length of a message": Guard(
        "seals.plugins.live.ros2",
        '        "transport/link/rx/max_message_size": 16 * MOST,\n', "", PEERS, "huge_message",
        "zenoh",
    ),
    "places of a guide": Guard(
        "seals.control.tracking", "abs(x) <= FARTHEST", "x == x", COUNTS, "places_lie"
    ),
    "number of places": Guard(
        "seals.control.tracking", "if not 1 <= len(places) <= MOST_PLACES or", "if", COUNTS,
        "places_lie",
    ),
    "rays of a sonar": Guard(
        "seals.plugins.sensors.sonar", "if tables > MOST_RAYS:", "if False:", COUNTS, "is_counted"
    ),
    "rays of a lidar": Guard(
        "seals.plugins.sensors.lidar",
        "if self.points * self.rings > MOST_RAYS or self.sectors > self.points:",
        "if False:",
        COUNTS, "is_counted",
    ),
}  # fmt: skip
"""Every one of them by name."""
