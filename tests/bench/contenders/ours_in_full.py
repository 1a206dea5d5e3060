"""`Controller.step` as a run uses it: the guard acts, and the trace goes to a file.

`scenarios.run` drains the ring every 50 ms. Here that is 50 ms of the arm's time, so that one step in seven pays for a
write as it would at the arm's own pace, however fast the benchmark runs.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from scenarios.analysis.recorder import DRAIN_SECONDS
from scenarios.analysis.trace import Event, TraceWriter
from tests.bench import problem
from tests.bench.contenders.ours import Ours
from vfi import Measurement, State


class OursInFull(Ours):
    name = "ours, guard and trace"
    guard = "act"

    def __init__(self):
        super().__init__()
        self.folder = TemporaryDirectory()
        path = Path(self.folder.name) / "bench.mcap"
        self.writer = TraceWriter(path, self.controller.columns, {"scene": "S5"})
        self.drained, self.wrote, self.state, self.events = 0, 0.0, State.RUN, 0
        self.resolved = 0

    def step(self):
        controller = self.controller
        command = controller.step(Measurement(self.t, self.full, self.velocity), problem.REFERENCE[self.k])
        if command.state is not self.state:
            self.state = command.state
            self.events += 1
            self.writer.note(Event(self.t, self.state.name, command.reason))
        if controller.cycles - self.drained >= len(controller.ring) // 2 or self.t - self.wrote > DRAIN_SECONDS:
            self.writer.write(controller.ring[np.arange(self.drained, controller.cycles) % len(controller.ring)])
            self.drained, self.wrote = controller.cycles, self.t
        return command.qdot

    def advance(self, qdot):
        super().advance(qdot)
        record = self.controller.ring[(self.controller.cycles - 1) % len(self.controller.ring)]
        self.resolved += int(record[self.controller.columns["resolves"]][0] > 0)

    def close(self):
        self.writer.__exit__(None, None, None)
        self.folder.cleanup()


CONTENDERS = (OursInFull,)
