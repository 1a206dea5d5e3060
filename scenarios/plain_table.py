"""The look that all tables on a terminal share."""

from rich.box import SIMPLE_HEAD
from rich.table import Table


def plain_table(title: str, caption: str) -> Table:
    """An empty table without frames, its title and caption on the left."""
    return Table(
        title=title,
        title_justify="left",
        caption=caption,
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
