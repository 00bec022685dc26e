"""Turn the formulas of a page into MathML while the site is built, so that readers need no script for them."""

import html
import re
from typing import Any

import latex2mathml.converter

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def _convert(found: "re.Match[str]") -> str:
    block = found[1] == "div"
    formula = latex2mathml.converter.convert(
        html.unescape(found[2]).strip(), display="block" if block else "inline"
    )
    return f'<div style="margin: 1em 0">{formula}</div>' if block else formula


def on_page_content(content: str, **_: Any) -> str:
    """Called by MkDocs with a page's HTML."""
    return _FORMULA.sub(_convert, content)
