"""The viewer: a session, its panels and its scene, held together by one worker."""

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from odeform.cancellation import Cancelled, cancel_unless
from odeform.checkpoint import bundled_checkpoints
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.formats.registry import shape_formats
from odeform.formats.writing import shape_at, write_motion, write_shape
from odeform.types import Floats
from odeform_viz.colors import color_of
from odeform_viz.columns import Column, Columns
from odeform_viz.fitting import fit_from_json
from odeform_viz.panels.compare import ComparePanel
from odeform_viz.panels.help import HelpPanel
from odeform_viz.panels.parameters import ParameterPanel
from odeform_viz.panels.playback import PlaybackPanel
from odeform_viz.panels.plots import PlotPanel
from odeform_viz.panels.quality import QualityPanel
from odeform_viz.panels.record import RecordPanel
from odeform_viz.panels.shape import ShapePanel
from odeform_viz.panels.stability import StabilityPanel
from odeform_viz.panels.status import MomentPanel, StatusPanel
from odeform_viz.panels.truth import TruthPanel
from odeform_viz.recording.writer import Recorder
from odeform_viz.rendering.error_colors import scale_for
from odeform_viz.rendering.scene import SceneView
from odeform_viz.runtime.clock import Clock
from odeform_viz.runtime.memory import MallocTrimmer, share_arenas
from odeform_viz.runtime.notices import Notices
from odeform_viz.runtime.server import open_server
from odeform_viz.runtime.worker import Worker
from odeform_viz.session import Session
from odeform_viz.state import capture, columns_of, state_from_json, state_to_json
from odeform_viz.view import DisplayOptions, Frame, ViewRequest, same_motions

__all__ = ["App"]

TICK = 1.0 / 30.0  # s between frames while playing
SETTLE = 0.15  # s without a new request after which the hand is taken to rest
READ = 0.2  # s between numbers that change as something moves: nobody reads faster


class App:
    """Serves a page in which the user's requests are met, the newest first and only."""

    def __init__(
        self,
        columns: Sequence[Column],
        host: str = "127.0.0.1",
        port: int = 8080,
        record: str | None = None,
    ) -> None:
        """The first of the columns, a model, gives the scene and its sliders; a record moves them to its parameters."""
        self.columns = Columns.of(columns)
        self.session = Session(columns[0].source.schema)
        share_arenas()
        # two threads of a product wait for each other: with a core busy elsewhere, ten times as long as one takes
        self._threads = threadpool_limits(1, "blas")
        self._tidy = MallocTrimmer()
        self.server = open_server(host, port, f"ODeform · {self.session.schema.scene}")
        self._record_to = record
        try:
            self._recorder = Recorder(record) if record else None
        except InputError:
            self.server.stop()
            raise
        self._worker = Worker(self._serve)
        assert columns[0].predictor is not None
        self._body = columns[0].predictor.rest
        self._build(columns)
        self._shown: Frame | None = None
        self._looks = DisplayOptions()
        self._heat: float | None = None
        self._settled = False
        self._told: Frame | None = None  # the frame that numbers and curves are of, and since when
        self._told_at = 0.0
        for column in columns:
            if column.truth:
                self._parameters.set(self.session.schema.known(column.truth.setting))
        self.clock.play()
        self._worker.start()

    def _build(self, columns: Sequence[Column]) -> None:
        schema, gui, wake = self.session.schema, self.server.gui, self._worker.wake
        self.clock = Clock(schema.window.start, schema.window.stop)
        say = self._say = Notices(self.server).show
        self._playback = PlaybackPanel(self.server, schema.window, self.clock, wake, self._largest, say)
        self._moment = MomentPanel(self.server)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Explore"):
            self._parameters = ParameterPanel(self.server, schema, _training_samples(columns[0]), wake)
            integrated = next((c.predictor for c in columns if c.predictor and c.predictor.qualities), None)
            self._quality = QualityPanel(self.server, integrated, wake) if integrated else None
            hold = partial(self._playback.jump, schema.window.start)
            self._shape = ShapePanel(self.server, self.columns, self._body, hold, self._changed, say)
            with gui.add_folder("View"):
                self._follow = gui.add_checkbox("follow the body", initial_value=True)
                self._follow.on_update(lambda _: wake())
            with gui.add_folder("About", expand_by_default=False):
                gui.add_markdown(_about(columns[0]))
        with tabs.add_tab("Compare"):
            models = {n: str(p) for n, p in bundled_checkpoints().items() if n.startswith(f"{schema.scene}/")}
            dataset = open_dataset(schema.scene) if schema.scene in bundled_datasets() else None
            read, move = self._parameters.parameters, self._parameters.set
            taught = columns[0].predictor.checkpoint.provenance.get("fixed", {}) if columns[0].predictor else {}
            self._truth = TruthPanel(self.server, schema, self.columns, dataset, taught, read, move, self._changed, say)
            self._compare = ComparePanel(self.server, schema, self.columns, models, read, self._changed, say)
        with tabs.add_tab("Record"):
            self._take = RecordPanel(
                self.server, schema.scene, self._record, self._save, self._restore, self._export, say
            )
        with tabs.add_tab("Help"):
            play, look = self._playback, self._compare
            keys = {
                "K": ("play or pause", play.toggle),
                "J": ("a frame back", lambda: play.step("◀")),
                "L": ("a frame on", lambda: play.step("▶")),
                "0": ("to the start", lambda: play.step("start")),
                "P": ("to the peak of the deformation", lambda: play.step("peak")),
                "O": ("columns overlaid or in a row", look.toggle_overlay),
                "C": ("error colours on or off", look.toggle_heat),
            }
            HelpPanel(self.server, keys)
        self._status = StatusPanel(self.server)
        self._plots = PlotPanel(self.server, schema.window)
        self._stability = None
        if columns[0].predictor and columns[0].origin:
            with self._plots.tab("Stability"):
                self._stability = StabilityPanel(self.server, columns[0].origin)
        extent = float(np.ptp(columns[0].geometry.points, axis=0).max())
        self._scene = SceneView(self.server, extent, len(columns))

    @property
    def url(self) -> str:
        host = self.server.get_host()
        return f"http://{'127.0.0.1' if host == '0.0.0.0' else host}:{self.server.get_port()}"

    def close(self) -> None:
        """Stop serving; a recording is completed."""
        self._truth.cancel()
        if self._stability:
            self._stability.close()
        self._worker.stop()
        self.server.stop()
        self._threads.restore_original_limits()
        if self._recorder:
            self._recorder.close()

    def request(self) -> ViewRequest:
        """What the page asks for now."""
        parameters = self.session.schema.complete(self._parameters.parameters())
        quality = self._quality.request() if self._quality else "balanced"
        return ViewRequest(parameters, self.clock.time(), quality, self.columns.all)

    def _read_looks(self) -> DisplayOptions:
        return DisplayOptions(self._compare.overlay, self._compare.heat, bool(self._follow.value))

    def _largest(self) -> float:
        return self.session.largest_deformation(self.request())

    def _changed(self) -> None:
        self._truth.refresh()
        self._compare.refresh()
        self._worker.wake()

    def _record(self, path: str | None) -> None:
        """ViewRequest for a recording, or for its end; the worker sees to it, on whose thread everything is logged.

        Who types a name in the page may have forgotten what bears it: nothing is overwritten.
        """
        if path is not None and (Path(path).suffix != ".rrd" or Path(path).exists()):
            self._take.show(None, 0, f"recording {path}: expected a name that ends in .rrd and is not taken yet")
            return
        self._record_to = path
        self._worker.wake()

    def _keep_recording(self) -> None:
        """Start or end the recording as requested. One that fails ends; the page goes on."""
        requested, recorder = self._record_to, self._recorder
        try:
            if recorder is not None and requested is None:
                self._recorder = None
                recorder.close()
                self._take.show(None, 0)
                self._take.finished(str(recorder.path), recorder.frames)
            elif recorder is None and requested is not None:
                self._recorder = Recorder(requested)
                self._shown = None  # the frame at hand belongs in it
        except InputError as error:
            self._stop_recording(error)
        if self._recorder is not None:
            self._take.show(requested, self._recorder.frames)

    def _stop_recording(self, error: InputError) -> None:
        """It cannot go on; who asked for it on the command line may not have that tab open."""
        self._recorder = self._record_to = None
        self._take.show(None, 0, str(error))
        print(f"error: {error}", file=sys.stderr)

    def _save(self) -> bytes:
        return state_to_json(capture(self.session.schema.scene, self.request(), self._read_looks()))

    def _restore(self, data: bytes) -> None:
        """`InputError` if the state is none, or a checkpoint of it is not at hand; the page then stays as it was."""
        schema = self.session.schema
        state = state_from_json(data, schema.scene)
        fit = fit_from_json(state.shape, self._body) if state.shape else None
        self.columns.replace_all(columns_of(state, schema))
        self._shape.set(fit)
        for note in state.notes:
            self._say(note)
        self._parameters.set(state.parameters)
        if self._quality:
            self._quality.set(state.quality)
        self._compare.set(state.display.overlay, state.display.error_colors)
        self._follow.value = state.display.follow
        self._playback.jump(state.time)
        self._changed()

    def _export(self, path: Path) -> Path:
        """Write the motion of the first visible model: the current frame in formats of one shape, else all frames."""
        request = self.request()
        column = next((c for c in request.columns if c.visible and c.predictor), None)
        if column is None:
            raise InputError("export: no model is shown")
        motion = self.session.new_motion(column, request)
        if path.suffix in shape_formats():
            path = path.with_stem(f"{path.stem}_{0:05d}")
            write_shape(shape_at(motion, request.time, column.fit), path)
            return path
        write_motion(motion, self.session.schema.window.times, path, column.fit)
        return path

    def _serve(self) -> float | None:
        """One round of the worker: read the newest request and show it; complete it once nothing changes any more."""
        try:
            self._keep_recording()
            request = self.request()
            looks = self._read_looks()
            if self._shape.arranging:
                # what one drags is where the first column is, which then is where all are
                looks = replace(looks, overlay=True)
            with cancel_unless(lambda: self._worker.up_to_date):
                self._meet(request, looks)
        except Cancelled:
            return 0.0
        except InputError as error:
            self._moment.show_error(str(error))
            self._shown, self._told, self._settled = None, None, True  # what comes next is shown, even if it was before
        if self._shown and self._shown.pending:
            return 0.0
        if self.clock.playing:
            return TICK
        return None if self._settled and self._told is self._shown else SETTLE

    def _meet(self, request: ViewRequest, looks: DisplayOptions) -> None:
        """Show it if it is new, first without the columns that take long; then tell of it."""
        shown = self._shown
        if shown is None or request != shown.request or looks != self._looks or shown.pending:
            # who scrubs is shown the others at each moment; who plays moves on by itself, and would never see the rest
            met = shown is not None and (
                request == shown.request or (self.clock.playing and shown.differs_in_time_only(request))
            )
            self._show(self.session.frame(request, include_slow=met), looks)
        elif not self._settled:
            self._settled = True
            self._describe(shown)
            self._tidy()
        elif self._told is not shown:
            self._describe(shown)

    def _show(self, frame: Frame, looks: DisplayOptions) -> None:
        # colours keep their scale over the whole motion, so it has to be known first
        self._heat = self._scale(frame) if looks.error_colors else None
        self._settled = self._shown is not None and same_motions(frame, self._shown)
        self._scene.publish(frame, looks, self._heat)
        self._shown, self._looks = frame, looks
        if self._recorder:
            try:
                with cancel_unless(lambda: True):  # what was shown is recorded
                    self._recorder.log(frame)
            except InputError as error:
                self._stop_recording(error)
        if frame.pending or time.monotonic() - self._told_at > READ:
            self._describe(frame)

    def _scale(self, frame: Frame) -> float | None:
        """The end of the colour scale in mm, one for all columns; None where nothing can be compared."""
        curves = [self.session.curves(shown, frame.request) for shown in frame.columns if shown.error]
        stop = self.session.schema.window.stop
        errors = [c.error[c.times <= stop] for c in curves if c.error is not None]
        return scale_for(np.concatenate(errors)) if errors else None

    def _describe(self, frame: Frame) -> None:
        """What accompanies a frame: the time, numbers, curves, marks at the sliders."""
        self._playback.show(frame.request.time)
        self._parameters.show()
        truth = frame.truth.column.truth if frame.truth else None
        away = truth is not None and not truth.of(frame.request.parameters)
        self._truth.show(away)
        self._moment.show(frame, self._heat, away)
        self._status.show(frame, self._settled)
        lines = [
            (shown.column.label, color_of(shown.column), self.session.curves(shown, frame.request))
            for shown in frame.columns
        ]
        self._plots.show(lines, frame.request.time)
        self._told, self._told_at = frame, time.monotonic()


def _training_samples(column: Column) -> dict[str, Floats]:
    """The values of each learned parameter in the training split, as far as the checkpoint tells."""
    if column.predictor is None or "training.theta" not in column.predictor.checkpoint.arrays:
        return {}
    theta = column.predictor.checkpoint.arrays["training.theta"]
    learned = column.predictor.schema.learned
    return {p.name: np.array([p.denormalise(float(x)) for x in theta[:, i]]) for i, p in enumerate(learned)}


def _about(column: Column) -> str:
    """What the scene leaves fixed, what to keep in mind, and where the model comes from."""
    assert column.predictor is not None
    provenance = column.predictor.checkpoint.provenance
    lines = list(column.source.schema.notes)
    if fixed := ", ".join(f"{name} {value:.4g}" for name, value in provenance.get("fixed", {}).items()):
        lines.append(f"Fixed: {fixed}.")
    lines += [f"Made by `{command}`." for command in provenance.get("command", [])]
    return "\n\n".join(lines)
