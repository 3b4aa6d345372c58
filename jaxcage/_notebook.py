"""How results show themselves in a notebook: the lines of their text as a small table, with the same numbers."""

import html
import re
from typing import Any


def notebook_html(self: Any) -> str:
    """`str(self)` as HTML: the first line as the head, the others as rows, cut where the text leaves a gap or after a
    colon. A class takes it as its method `_repr_html_`.
    """
    head, *lines = str(self).splitlines() or [""]
    rows = [re.split(r"\s{2,}|(?<=:)\s", line.strip()) for line in lines]
    cells = [[f'<td style="text-align: left">{html.escape(cell)}</td>' for cell in row] for row in rows]
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in cells)
    table = f"<table><tbody>{body}</tbody></table>" if rows else ""
    return f"<div><strong>{html.escape(head)}</strong>{table}</div>"
