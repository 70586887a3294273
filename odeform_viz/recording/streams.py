"""Rerun's streams, made to end. By itself Rerun keeps two threads and megabytes of each until the process ends."""

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

__all__ = ["end_unused_streams", "send_blueprint"]


def end_unused_streams() -> None:
    """End all streams that nothing refers to any more, as `rerun.init` does."""
    rerun_bindings.flush_and_cleanup_orphaned_recordings()


def send_blueprint(stream: rr.RecordingStream, blueprint: rrb.Blueprint) -> None:
    """Add a layout to a recording.

    `stream.send_blueprint` makes a stream for it that stays connected, so that it never ends.
    """
    native = rerun_bindings.new_blueprint(
        stream.get_application_id() or "", make_default=False, make_thread_default=False
    )
    layout = rr.RecordingStream._from_native(native)
    layout.set_time("blueprint", sequence=0)
    blueprint._log_to_stream(layout)
    storage = layout.memory_recording().storage
    rerun_bindings.send_blueprint(storage, make_active=True, make_default=True, recording=stream.to_native())
    layout.disconnect()
