"""What the site has beside the pages of docs/: README.md as its home, notebooks, tables from the code, checked links.

MkDocs calls the functions below; a warning ends `mkdocs build --strict`.
"""

from __future__ import annotations

import logging
import posixpath
import re
from collections.abc import Callable
from pathlib import Path

import command_line
import notebooks
import tables
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

LOG = logging.getLogger("mkdocs.hooks.site")
ROOT = Path(__file__).resolve().parents[2]
GENERATED: dict[str, Callable[[], str]] = {
    "command line": command_line.reference,
    "node parameters": tables.node_parameters,
    "plant parameters": tables.plant_parameters,
    "models": tables.models,
    "methods": tables.methods,
    "mechanisms": tables.mechanisms,
    "physical parameters": tables.physical_parameters,
}
_PLACE = re.compile(r"^<!-- generated: (.*?) -->$", re.MULTILINE)
_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#|/)([^)#\s]+)")
_BY_FILE = re.compile(r"\[([\w/]+\.md)\]\(([\w/.]+\.md)")
# A program that a page has its reader write is shown as what it is.
_WRITTEN = re.compile(r"^```bash\ncat > (\S+\.py) <<'EOF'\n(.*?)^EOF\n```$", re.MULTILINE | re.DOTALL)
_FETCHED = re.compile(r"<(?:script|img|iframe|source|link)\b[^>]*\s(?:src|href)=\"?((?:https?:)?//[^\"\s>]+)")
_FENCE = re.compile(r"^( *)(```|~~~).*?^\1\2 *$", re.MULTILINE | re.DOTALL)
# Code in a text that is the name of a file of this repository, or of a module as seen from the package.
_NAMED = re.compile(r"(?<!`)`((?:[\w.-]+/)+[\w.-]*|[\w-]+\.py)`(?!`)")
_SEEN_FROM = ("", "docs", "xb_muscle_ros", "xb_muscle_ros/diagnose")
_FOLDERS = ("config", "docs", "launch", "scripts", "test", "xb_muscle_ros")
# What a page asks its reader to write.
_TO_BE_WRITTEN = ("my_filament.py",)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """README.md becomes the home page, and each notebook a page."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    home = _LINK.sub(lambda link: posixpath.relpath(link[1], "docs"), text)
    files.append(File.generated(config, "index.md", content=f"---\nhide: [navigation]\n---\n{home}"))
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        files.remove(file)
        page = notebooks.as_page(Path(file.abs_src_path))
        name = posixpath.splitext(file.src_uri)[0]
        files.append(File.generated(config, f"{name}.md", content=page.text))
        for picture, data in page.pictures.items():
            where = posixpath.join(posixpath.dirname(name), picture)
            files.append(File.generated(config, where, content=data))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put generated parts in their places, and see that files which a page names are there."""

    def part(place: re.Match[str]) -> str:
        if place[1] in GENERATED:
            return GENERATED[place[1]]()
        LOG.warning("%s: nothing is generated as '%s'; known: %s", page.file.src_uri, place[1], ", ".join(GENERATED))
        return ""

    _check_names(markdown, page.file.src_uri)
    folder = posixpath.dirname(page.file.src_uri)
    linked = _LINK.sub(lambda link: _within(link[1], folder, page.file.src_uri, config, files), markdown)
    titled = _BY_FILE.sub(lambda link: f"[{_title(link, folder, files)}]({link[2]}", linked)
    return _PLACE.sub(part, _WRITTEN.sub(r'```python title="\1"\n\2```', titled))


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """See that a reader's browser asks no other host for anything."""
    for found in _FETCHED.finditer(output):
        LOG.warning("%s: the page loads %s from another host", page.file.src_uri, found[1])
    return output


def _title(link: re.Match[str], folder: str, files: Files) -> str:
    """What the menu calls a page that a text calls by its file's name."""
    file = files.get_file_from_path(posixpath.normpath(posixpath.join(folder, link[2])))
    return str(file.page.title) if file is not None and file.page is not None and file.page.title else link[1]


def _within(link: str, folder: str, page: str, config: MkDocsConfig, files: Files) -> str:
    """A link that stays within the site: a file of the repository outside of docs/ goes along."""
    target = posixpath.normpath(posixpath.join("docs", folder, link))
    if target.startswith("docs/"):
        return re.sub(r"\.ipynb$", ".md", link)
    if target == "README.md":
        return posixpath.relpath("index.md", folder or ".")
    if not (ROOT / target).is_file():
        LOG.warning("%s: link to %s, which is no file of this repository", page, target)
        return link
    # Browsers show text, but save what ends in .py or has no ending.
    copy = f"files/{target}.txt"
    if files.get_file_from_path(copy) is None:
        files.append(File.generated(config, copy, content=(ROOT / target).read_bytes()))
    return posixpath.relpath(copy, folder or ".")


def _check_names(markdown: str, page: str) -> None:
    for named in _NAMED.finditer(_FENCE.sub("", markdown)):
        name = named[1]
        first = name.partition("/")[0]
        is_module = name.endswith((".py", ".c"))
        if not (is_module or first in _FOLDERS) or first == "out" or name.endswith(_TO_BE_WRITTEN):
            continue
        if not any((ROOT / start / name).exists() for start in _SEEN_FROM) and not _anywhere(name):
            LOG.warning("%s: names %s, which is not in this repository", page, name)


def _anywhere(name: str) -> bool:
    """Whether a bare file name is that of one module or more."""
    return "/" not in name and any((ROOT / "xb_muscle_ros").rglob(name))
