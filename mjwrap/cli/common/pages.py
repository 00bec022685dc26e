"""Templates of HTML pages, which escape every name."""

from __future__ import annotations

from importlib import resources

import jinja2


def report_template(room: str) -> jinja2.Template:
    """Return the template report.html.j2 of a command; room: its package, such as "mjwrap.cli.compare"."""
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    source = resources.files(room) / "report.html.j2"
    return environment.from_string(source.read_text(encoding="utf-8"))
