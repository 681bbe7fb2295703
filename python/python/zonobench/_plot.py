"""Pictures of sets with matplotlib, where it is installed."""

from __future__ import annotations

from typing import Any

from ._native import Ellipsoid, Error, Set


def attach(cls: type[Set]) -> None:
    """Gives sets `plot`."""
    cls.plot = plot  # type: ignore[method-assign]


def plot(self: Set, ax: Any = None, dims: tuple[int, int] = (0, 1), **style: Any) -> Any:
    """Draws the projection of the set on two components and returns the axes.

    ax: matplotlib axes, the current ones unless given; style: what `Axes.fill` takes. A picture, not an enclosure. Needs
    matplotlib.
    """
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.gca()
    if len(dims) != 2:
        raise Error(f"plot: expected two components, got {len(dims)}")
    flat = self.project(*dims)
    corners = flat.outline() if isinstance(flat, Ellipsoid) else flat.vertices()
    style = {"alpha": 0.4, "edgecolor": "black", "linewidth": 0.8, **style}
    ax.fill(corners[:, 0], corners[:, 1], **style)
    return ax
