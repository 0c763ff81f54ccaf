"""The site of the documentation, made by build.sh with Debian's Sphinx."""
import os
import re
from pathlib import Path

from sphinx.util.nodes import make_refnode

project = "palpate"
author = "the founders of palpate"
version = release = os.environ["PALPATE_VERSION"]
html_title = f"palpate {version}"
root_doc = "README"
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc"]
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/*.md", "docs/[!s]*/**.md", "integration/toolkit/*/README.md",
                    "reference/*.md"]

myst_enable_extensions = ["deflist"]
# As deep as other pages link to.
myst_heading_anchors = 4
# What GitHub shows without colours too.
# Blocks without a language are commands and what they print.
highlight_language = "text"
suppress_warnings = ["myst.header", "misc.highlighting_failure"]

breathe_projects = {"palpate": os.environ["PALPATE_XML"]}
breathe_default_project = "palpate"
breathe_domain_by_extension = {"h": "c"}
breathe_show_include = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"

html_theme = "furo"
html_theme_options = {"sidebar_hide_name": False}
html_static_path = ["static"]
html_css_files = ["site.css"]
# "--option" stays as it is typed.
smartquotes = False
html_extra_path = ["extra"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False

# The order of docs/README.md. Pages that other parts of the build make may be missing.
contents = {
    "Begin": ["docs/README"],
    "Use": ["docs/using/install", "docs/using/feel", "docs/using/look", "docs/using/headset", "docs/using/web", "docs/using/motion", "docs/using/check",
            "docs/using/cohort", "docs/openigtlink", "docs/scene-file", "docs/x3d", "docs/using/options", "docs/limits"],
    "Embed": ["docs/using/library", "docs/using/hosts", "integration/toolkit/dotnet/README", "integration/toolkit/godot/README",
              "integration/toolkit/paraview/README", "integration/toolkit/slicer/README", "integration/toolkit/blender/README",
              "docs/writing-a-mode", "docs/force-limits"],
    "Reference": ["reference/palpate", "reference/c", "reference/python"],
    "Change": ["docs/architecture", "docs/motion-method", "CONTRIBUTING", "docs/glossary", "docs/using/measure", "CHANGELOG"],
    "Decisions": ["docs/decisions/haptics", "docs/decisions/motion-engine", "docs/decisions/files", "docs/decisions/view",
                  "docs/decisions/devices", "docs/decisions/xr", "docs/decisions/library", "docs/decisions/command-line"],
    "Measurements": ["docs/benchmarks/two-core-lavapipe", "docs/benchmarks/two-core-hand", "docs/benchmarks/two-core-view",
                     "docs/benchmarks/two-core-chart", "docs/benchmarks/gpu"],
}


def toctree(pages, caption=""):
    """Markdown of a table of contents that is shown beside the page only."""
    return "\n```{toctree}\n:hidden:\n" + (f":caption: {caption}\n" if caption else "") + "\n" + "\n".join(pages) + "\n```\n"


def add_contents(app, name, source):
    """README is GitHub's front page too, so the site's table of contents is not in it; nor are the trials of the motion engine, which that
    page lists in a table."""
    if name == root_doc:
        for caption, pages in contents.items():
            source[0] += toctree([page for page in pages if (Path(app.srcdir) / (page + ".md")).exists()], caption)
    elif name == "docs/decisions/motion-engine":
        source[0] += toctree(re.findall(r"\]\((motion/[\w-]+)\.md\)", source[0]))


def link_folder(app, env, node, content):
    """A folder has no page: docs/README.md lists what is in those of docs; of others the site shows the name only."""
    target = node["reftarget"]
    folder = Path(env.doc2path(node["refdoc"])).parent / target
    if not folder.is_dir():
        return None
    if not list(folder.glob("*.md")):
        return content
    return make_refnode(app.builder, node["refdoc"], "docs/README", "", content)


def list_arguments(app, what, name, thing, options, lines):
    """The module's documentation is plain text: "name: meaning" with its further lines indented becomes an item of a list, other indented
    lines are code."""
    if what == "attribute":
        return
    made, depth, code = [], None, False
    for line in lines:
        indent, text = (len(line) - len(line.lstrip())) // 4, line.strip()
        item = re.match(r"([a-z_0-9]+(?:, [a-z_0-9]+)*): (.+)", text)
        escaped = re.sub(r"(?<=\w)_(?!\w)", r"\\_", text.replace("*", r"\*"))
        if not text:
            made.append("")
            depth = None
            code = False
        elif item and not code:
            if depth != indent:
                made.append("")
            depth = indent
            made.append(f"{'  ' * indent}* **{item[1]}**: {escaped[len(item[1]) + 2:]}")
        elif depth is not None:
            made[-1] += " " + escaped
        elif indent:
            if not code:
                made += ["::", ""]
            code = True
            made.append(line)
        else:
            made.append(escaped)
    lines[:] = made


def setup(app):
    app.connect("autodoc-process-docstring", list_arguments)
    app.connect("source-read", add_contents)
    app.connect("missing-reference", link_folder)
