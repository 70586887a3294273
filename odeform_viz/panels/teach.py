"""Teaches a model the user's own body: simulates pushes of it, and refines the model by them, in other processes."""

import time
from collections.abc import Callable
from pathlib import Path

import odeform
from odeform.errors import InputError
from odeform.simulation.objects.user_object import object_name
from odeform.simulation.user_data import digest
from odeform_viz.page import Page
from odeform_viz.panels.callbacks import LOCK, serialized
from odeform_viz.runtime.jobs import Job, Lesson, refine_model, simulate_lessons
from odeform_viz.user_bodies import (
    TaughtBodyPredictor,
    UserBody,
    UserBodyPredictor,
    refined_column,
    user_body_of,
)
from odeform_viz.view import DISTANCE

__all__ = ["Teaching", "describe_lesson", "describe_result", "lesson_folder"]

FOLDER, MODEL = "taught", "model.safetensors"
MOTIONS = ("10", "20", "40")
MINUTES = 5.0  # of processor time at most, for the refinement
SCENE = "contact-force"
OFFER = (
    "The simulator pushes this very body, and the model learns from it. It takes some minutes; the page stays quick."
)
LABEL = "refined"


def lesson_folder(body: UserBody) -> str:
    """The folder of what is learned of a body, inside of the workspace; other nodes or materials have others."""
    return f"{FOLDER}/{object_name(body.item.name)}-{digest(body.item)[:6]}"


def describe_lesson(lesson: Lesson, seconds: float, begun: int) -> str:
    """Says in one line how far the teaching is, `seconds` after it began with `begun` motions that were there."""
    if lesson.simulated < lesson.motions:
        new = lesson.simulated - begun
        left = f"{_minutes(seconds / new * (lesson.motions - lesson.simulated))} left, then" if new else "then"
        return (
            f"Simulated {lesson.simulated} of {lesson.motions} motions; {left} up to {MINUTES:g} minutes of learning."
        )
    left = _minutes(60.0 * MINUTES * (1.0 - lesson.spent))
    return f"Learning from {lesson.motions} motions; at most {left} left. {lesson.line}".strip()


def describe_result(before: float, after: float, minutes: float, folder: str) -> str:
    """Says in Markdown what was reached: errors in mm, as RMS distances on motions that were not learned, and the
    minutes spent."""
    better = f"**{before:.2g} mm → {after:.2g} mm**"
    return (
        f"Taught in {minutes:.1f} minutes: error {better}, of the first guess and of the refined model, on simulated "
        f"motions that it has not seen. Kept in `{folder}`; `--checkpoint {folder}/{MODEL}` opens it again."
    )


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"


class Teaching:
    """The controls: one button, with progress and cancellation."""

    def __init__(self, page: Page, changed: Callable[[], None]) -> None:
        """Add the controls to the page's; `changed` is called where the columns have another model."""
        self._page, self._changed = page, changed
        self._job: Job | None = None
        self._clicked = self._begin = 0.0  # s
        self._begun: int | None = None
        gui = page.server.gui
        self._count = gui.add_dropdown(
            "motions",
            MOTIONS,
            initial_value=MOTIONS[1],
            visible=False,
            hint="how many pushes are simulated: with more it learns more, and takes longer",
        )
        self._start = gui.add_button("Teach this shape", visible=False, hint=OFFER)
        self._start.on_click(serialized(self._teach))
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button(
            "Cancel teaching", color="gray", visible=False, hint="what is simulated and learned so far is kept"
        )
        self._cancel.on_click(serialized(self._give_up))
        self._text = gui.add_markdown("", visible=False)

    @property
    def running(self) -> bool:
        """Whether a body is being taught."""
        return self._job is not None and self._job.running

    def show(self, body: UserBody | None) -> None:
        """Offers to teach a body, where the model can learn it."""
        offered = body is not None and self._page.schema.scene == SCENE and bool(self._origin())
        self._start.visible = self._count.visible = offered and not self.running
        self._bar.visible = self._cancel.visible = self.running
        if not offered:
            self._say("")

    def close(self) -> None:
        """Cancel the work in progress, if any. What is finished is kept."""
        if self._job is not None and self._job.running:
            self._job.cancel()

    def _origin(self) -> str:
        return self._page.model.origin

    def _say(self, text: str) -> None:
        self._text.content, self._text.visible = text, bool(text)

    def _teach(self) -> None:
        predictor = self._page.model.predictor
        body = user_body_of(predictor)
        if self.running or body is None or not isinstance(predictor, UserBodyPredictor):
            return
        try:
            folder = self._page.workspace.inside(lesson_folder(body))
            if self._count.value not in MOTIONS:
                raise InputError(f"motions: expected one of {', '.join(MOTIONS)}, got {self._count.value!r}")
            count = max(int(self._count.value), _simulated(folder))
        except InputError as error:
            self._failed(str(error))
            return
        self._clicked, self._begun = time.monotonic(), None
        args = (body.item, body.like, str(folder), count)
        self._run(Job(simulate_lessons, args, lambda _: self._refine(folder), self._failed, self._progress))
        self._say(f"Laying **{body.item.name}** on the simulator's floor...")

    def _refine(self, folder: Path) -> None:
        with LOCK:
            out = folder / MODEL
            args = (self._origin(), str(folder), str(out), MINUTES)
            self._run(Job(refine_model, args, lambda found: self._taught(folder, found), self._failed, self._progress))
            self._say("Learning from the simulated motions...")

    def _run(self, job: Job) -> None:
        self._job = job
        job.start()
        self.show(user_body_of(self._page.model.predictor))

    def _progress(self, lesson: Lesson) -> None:
        if self._begun is None:  # laying it on the floor says nothing of how long a motion takes
            self._begin, self._begun = time.monotonic(), lesson.simulated
        done = 0.5 * lesson.simulated / max(lesson.motions, 1) + 0.5 * lesson.spent
        self._bar.value = 100.0 * min(done, 1.0)
        self._say(describe_lesson(lesson, time.monotonic() - self._begin, self._begun))

    def _taught(self, folder: Path, found: tuple[float, float, float]) -> None:
        minutes = (time.monotonic() - self._clicked) / 60.0
        try:
            name = str(folder / MODEL)
            refined = odeform.load(name)
            with LOCK:
                column = refined_column(self._page.columns.all, LABEL, refined, name)
                for old in self._page.columns.all:
                    if isinstance(old.predictor, TaughtBodyPredictor):
                        self._page.columns.remove(old.key)
                self._page.columns.add(column)
        except InputError as error:
            self._failed(str(error))
            return
        before, after = (DISTANCE * error for error in found[:2])
        shown = folder.relative_to(self._page.workspace.root)
        self._say(describe_result(before, after, minutes, str(shown)))
        self.show(user_body_of(self._page.model.predictor))
        self._changed()

    def _failed(self, message: str) -> None:
        self._page.notices.show("Shape not taught", message)
        self.show(user_body_of(self._page.model.predictor))
        self._say(f"⚠ **{message}** What is finished is kept; the button goes on from there.")

    def _give_up(self) -> None:
        self.close()
        self.show(user_body_of(self._page.model.predictor))
        self._say("Cancelled. What is finished is kept; the button goes on from there.")


def _simulated(folder: Path) -> int:
    """The number of motions that were asked for in a folder before: fewer cannot be asked for again."""
    from odeform.dataset.folder import INDEX, open_folder

    if not (folder / INDEX).exists():
        return 0
    asked = open_folder(folder).provenance.get("count", {})
    return max((int(number) for number in asked.values()), default=0) if isinstance(asked, dict) else 0
