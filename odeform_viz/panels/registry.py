"""The panels of the page, in their order. A panel is one module and one line here."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

from odeform_viz.page import Page

__all__ = ["PANELS", "Entry", "build_panels"]


@dataclass(frozen=True)
class Entry:
    """Says where a panel stands (see `Layout`), and its class as "module:Class"."""

    place: str
    panel: str


PANELS: tuple[Entry, ...] = (
    Entry("side", "odeform_viz.panels.caption:CaptionPanel"),
    Entry("side", "odeform_viz.panels.shape_warning:ShapeWarningPanel"),
    Entry("side", "odeform_viz.panels.playback:PlaybackPanel"),
    Entry("side", "odeform_viz.panels.summary:SummaryPanel"),
    Entry("side/Explore", "odeform_viz.panels.load:LoadPanel"),
    Entry("side/Explore", "odeform_viz.panels.push:PushPanel"),
    Entry("side/Explore", "odeform_viz.panels.parameters:ParameterPanel"),
    Entry("side/Explore", "odeform_viz.panels.quality:QualityPanel"),
    Entry("side/Explore", "odeform_viz.panels.shape:ShapePanel"),
    Entry("side/Explore", "odeform_viz.panels.user_body:UserBodyPanel"),
    Entry("side/Explore", "odeform_viz.panels.stability:StabilityPanel"),
    Entry("side/Compare", "odeform_viz.panels.truth:TruthPanel"),
    Entry("side/Compare", "odeform_viz.panels.fit:FitPanel"),
    Entry("side/Compare", "odeform_viz.panels.compare:ComparePanel"),
    Entry("side/View", "odeform_viz.panels.camera:CameraPanel"),
    Entry("side/View", "odeform_viz.panels.status:StatusPanel"),
    Entry("side/View", "odeform_viz.panels.about:AboutPanel"),
    Entry("side/Record", "odeform_viz.panels.record:RecordPanel"),
    Entry("side/Record", "odeform_viz.panels.page_state:StatePanel"),
    Entry("side/Record", "odeform_viz.panels.export:ExportPanel"),
    Entry("side/Record", "odeform_viz.panels.picture:PicturePanel"),
    Entry("bottom/Over time", "odeform_viz.panels.plots:PlotPanel"),
    Entry("side", "odeform_viz.panels.theme:ThemePanel"),
    Entry("side", "odeform_viz.panels.axes:AxesPanel"),
    Entry("side/Help", "odeform_viz.panels.help:HelpPanel"),  # last: it lists the hot keys of all others
)


def build_panels(page: Page, entries: Sequence[Entry] = PANELS) -> None:
    """Build the panels that the page needs, in order, into `page.panels`."""
    for entry in entries:
        module, _, name = entry.panel.partition(":")
        kind = getattr(import_module(module), name)
        if kind.needed(page):
            with page.layout.at(entry.place):
                page.panels.append(kind(page))
