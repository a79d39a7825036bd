"""Pages of the site that do not lie in docs/: a hook of MkDocs.

Files elsewhere in the repository (README, CONTRIBUTING, ...) become pages, their links point to the
site's; the API reference has a page for each public module; the command line's page is its help.
"""

from __future__ import annotations

import importlib
import posixpath
import re
import sys
from pathlib import Path

import click
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import clpt
from clpt import errors
from clpt.cli import cli

ROOT = Path(__file__).resolve().parents[2]
ELSEWHERE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "kernels/README.md": "kernels.md",
    "examples/README.md": "examples.md",
    "bench/results/README.md": "figures.md",
    "bench/notes/README.md": "notes/index.md",
    **{
        f"bench/notes/{page.name}": f"notes/{page.name}"
        for page in sorted((ROOT / "bench/notes").glob("[a-z]*.md"))
    },
}
MODULES = {
    "clpt.scene": "scene",
    **{
        f"clpt.scene.{category}": category
        for category in (
            "cameras",
            "shapes",
            "materials",
            "textures",
            "lights",
            "media",
            "motion",
            "integrators",
        )
    },
    "clpt.scene.values": "values",
    "clpt.spectra": "spectra",
    "clpt.transforms": "transforms",
    "clpt.images.colour": "colour",
    "clpt.denoise": "denoise",
    "clpt.lenses": "lenses",
    "clpt.mie": "mie",
    "clpt.measured": "measured",
    "clpt.device": "device",
    "clpt.bvh": "bvh",
    "clpt.bench": "benchmark",
    "clpt.testing": "testing",
    "clpt.rays.trimesh_ray": "trimesh_ray",
}
PARTS = {  # modules on the page of their package, which exports no names itself
    "clpt.images.colour": ("tones", "view"),
    "clpt.denoise": ("oidn", "statistical", "needs"),
}
SHOWN = {*MODULES, *(f"{package}.{part}" for package, parts in PARTS.items() for part in parts)}
DEEPER = {"heading_level": 3}
TABS = {"json": "JSON", "python": "Python", "xml": "Mitsuba XML"}
BLOCK = r"^```(?:{})\n(?:(?!```).*\n)*```\n"
TABBED = re.compile(
    rf"{BLOCK.format('json')}\n?{BLOCK.format('python')}(?:\n?{BLOCK.format('xml')})?", re.M
)
LINK = re.compile(r"(!?)\[((?:`[^`]*`|[^\]\[])*)\]\((?!\w+:)([^)#\s]*)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages and the pictures that they show."""
    for source, page in ELSEWHERE.items():
        files.append(File.generated(config, page, abs_src_path=str(ROOT / source)))
    files.append(File.generated(config, "api/clpt.md", content=names_of_clpt()))
    for module, page in MODULES.items():
        parts = [f"# `{module}`", f"::: {module}"]
        for part in PARTS.get(module, ()):
            parts += [f"## `{module}.{part}`", f"::: {module}.{part}\n    options: {DEEPER}"]
        files.append(File.generated(config, f"api/{page}.md", content="\n\n".join(parts)))
    files.append(File.generated(config, "command_line.md", content=command_line()))
    for name in pictures():
        files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    return files


def pictures() -> list[str]:
    """Return the pictures of scenes, which lie beside them."""
    found = sorted(ROOT.glob("scenes/*/picture*"))
    return [picture.relative_to(ROOT).as_posix() for picture in found]


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links point to pages of the site; those to source files become text."""
    own = page.file.src_uri
    origin = next((source for source, name in ELSEWHERE.items() if name == own), f"docs/{own}")

    def relinked(match: re.Match[str]) -> str:
        picture, text, target, anchor = match.groups("")
        if not target:
            return match[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(origin), target))
        page_path = ELSEWHERE.get(path, path.removeprefix("docs/"))
        if files.get_file_from_path(page_path) is None:
            if not (ROOT / path).exists():
                return match[0]  # a dead link: MkDocs complains
            return f"`{text}`" if "." in text and "`" not in text else text
        relative = posixpath.relpath(page_path, posixpath.dirname(own) or ".")
        return f"{picture}[{text}]({relative}{anchor})"

    return TABBED.sub(_tabs, LINK.sub(relinked, markdown))


def _tabs(match: re.Match[str]) -> str:
    """Return tabs for a block of JSON that one of Python, and perhaps of XML, follows."""
    parts = []
    for block, language in re.findall(r"(```(\w+)\n.*?```\n)", match[0], re.S):
        inside = re.sub(r"^(?=.)", "    ", block, flags=re.M)
        parts.append(f'=== "{TABS[language]}"\n\n{inside}')
    return "\n".join(parts)


def names_of_clpt() -> str:
    """Return a page of `clpt.__all__`, by module: the renderer first, errors last."""
    groups: dict[str, list[str]] = {}
    for name in clpt.__all__:
        if not name.startswith("_"):
            groups.setdefault(_home(name), []).append(name)
    last = {"clpt.render.renderer": -1, errors.__name__: 1}
    parts = ["# `clpt`"]
    for module in sorted(groups, key=lambda module: (last.get(module, 0), module)):
        summary = (importlib.import_module(module).__doc__ or "").split("\n\n")[0]
        parts.append(f"## {re.split('[:;]', summary.rstrip('.'))[0]}")
        for name in groups[module]:
            own = f"{module}.{getattr(clpt, name).__name__}"
            options = {
                "show_root_heading": True,
                "heading_level": 3,
                "heading": name,
                "inherited_members": True,
            }
            parts.append(
                f"[`{name}`][{own}]" if module in SHOWN else f"::: {own}\n    options: {options}"
            )
    return "\n\n".join(parts)


def _home(name: str) -> str:
    """Return the module of a public name: its package, where that exports it."""
    module = getattr(clpt, name).__module__
    package = module.rpartition(".")[0]
    exported = package != "clpt" and name in getattr(sys.modules[package], "__all__", ())
    return package if exported else module


def command_line() -> str:
    """Return a page with the help of every command."""
    context = click.Context(cli, info_name="clpt", terminal_width=90, max_content_width=90)
    parts = ["# Command line", _commands(context)]
    for name in cli.list_commands(context):
        command = cli.get_command(context, name)
        if command is not None:
            own = click.Context(command, context, name)
            parts += [f"## clpt {name}", _help(command, own)]
            if isinstance(command, click.Group):
                for part, inner in command.commands.items():
                    parts += [
                        f"### clpt {name} {part}",
                        _help(inner, click.Context(inner, own, part)),
                    ]
    return "\n\n".join(parts)


def _commands(context: click.Context) -> str:
    """Return a table of the commands, each with the first sentence of its help."""
    rows = ["| command | what it does |", "| --- | --- |"]
    for name in cli.list_commands(context):
        if (command := cli.get_command(context, name)) is not None and not command.hidden:
            summary = command.get_short_help_str(limit=1000).replace("|", "\\|")
            rows.append(f"| [clpt {name}](#clpt-{name}) | {summary} |")
    return "\n".join(rows)


def _help(command: click.Command, context: click.Context) -> str:
    context.terminal_width = 90
    return f"```text\n{command.get_help(context)}\n```"
