"""Pages that the site has beyond the files of this folder, made while it is built: see `mkdocs.yml`.

Notebooks, pages that commands write, figures, the reference of every layer and the tables of the glossary become pages
of the site; links to those files become links to the pages; equations become MathML.
"""

import ast
import base64
import functools
import importlib
import json
import pathlib
import re
from collections.abc import Iterator
from typing import Any

import griffe
from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files


ROOT = pathlib.Path(__file__).parent.parent
PACKAGE = ROOT / "jaxcage"
WRITTEN = {"VALIDATION.md": "validation.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"} | {
    f"benchmarks/{name}.md": f"{name}.md" for name in ("speed", "orbits", "trends")
}
"""Pages that stand elsewhere in the checkout, and where the site has them."""
PLACES = WRITTEN | {"README.md": "index.md"}


def public_names(layer: str = "") -> list[str]:
    """The names that a layer offers, or those of `jaxcage` itself, without the layers."""
    file = PACKAGE / layer / "__init__.py" if layer else PACKAGE / "_public.py"
    names = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module != "typing":
            names += [alias.asname for alias in node.names if alias.asname]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.append(node.target.id)
    return [name for name in names if not name.startswith("_")] + ([] if layer else ["keep_compiled_programs"])


def layers() -> list[str]:
    """The packages of `jaxcage`, as its reference lists them."""
    return sorted(folder.name for folder in PACKAGE.iterdir() if (folder / "__init__.py").exists())


def homes() -> dict[str, str]:
    """Every name of `jaxcage` itself with the layer that has it too, if one has."""
    of_layer = {layer: public_names(layer) for layer in layers()}
    return {n: next((layer for layer, names in of_layer.items() if n in names), "") for n in public_names()}


@functools.cache
def _tree() -> Any:
    return griffe.load("jaxcage", search_paths=[str(ROOT)])


def _named(layer: str, name: str) -> Any:
    """Return what a layer offers under a name: the function, where a file of the layer has the same name."""
    found = _tree()[layer][name]
    return found[name] if found.is_module else found


def entry(layer: str, name: str) -> str:
    """The entry of a name; of constants assigned two at a time, which griffe does not see, the value."""
    path = f"jaxcage.{layer}.{name}"
    try:
        named = _named(layer, name)
        named.docstring
    except griffe.AliasResolutionError:
        value = getattr(importlib.import_module(f"jaxcage.{layer}"), name)
        return f"## `{name}` {{#{path}}}\n\n`{value!r}`"
    return f"::: {path}" if named.path != f"{path}.{name}" else f"[](){{#{path}}}\n\n::: {path}.{name}"


def reference(layer: str) -> str:
    """The page of a layer: what it is responsible for, then each of its names."""
    docstring = ast.get_docstring(ast.parse((PACKAGE / layer / "__init__.py").read_text(encoding="utf-8")))
    summary = (docstring or "").split("\n\n")[0]
    return "\n\n".join([f"# {layer}", summary, *(entry(layer, name) for name in public_names(layer))])


def top_reference() -> str:
    """The page of `jaxcage` itself: a table of its names, and in full those that no layer has."""
    said = lambda layer, name: _named(layer, name).docstring.value.split("\n\n")[0].replace("\n", " ")
    link = lambda layer, name: f'<a id="jaxcage.{name}"></a>[`{name}`][{_named(layer, name).path}]'
    rows = [
        f"| {link(layer, name)} | [`{layer}`]({layer}.md) | {said(layer, name)} |"
        for name, layer in sorted(homes().items(), key=lambda item: item[0].lower())
        if layer
    ]
    own = [f"::: jaxcage.{name}" for name, layer in homes().items() if not layer]
    text = "The names that `import jaxcage as jc` offers. Those in the table are explained in the layer they come from."
    return "\n\n".join(
        ["# jaxcage", text, "\n".join(["| name | layer | what it is or does |", "|---|---|---|", *rows]), *own]
    )


def gallery(notebook: pathlib.Path) -> tuple[str, dict[str, bytes]]:
    """A notebook as Markdown, and its figures by file name."""
    parts, figures = [], {}
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                name = f"{notebook.stem}_{len(figures) + 1}.png"
                figures[name] = base64.b64decode("".join(data["image/png"]))
                parts.append(f"![Figure {len(figures)} of {notebook.stem}]({name})")
            elif (said := "".join(output.get("text", data.get("text/plain", ())))) and not said.startswith(
                "<matplotlib"
            ):
                parts.append(f"```text\n{said.rstrip()}\n```")
    return "\n\n".join(parts), figures


def outputs() -> str:
    """The glossary of outputs."""
    from jaxcage.quantities import GLOSSARY

    rows = (f"| `{q.name}` | {q.symbol} | {q.unit} | {q.shown_unit} | {q.text} |" for q in GLOSSARY.values())
    return "\n".join(["| name | symbol | SI unit | shown in | meaning |", "|---|---|---|---|---|", *rows])


def parameters() -> str:
    """Every parameter of the cage model."""
    import jaxcage as jc

    jc.enable_x64()
    info = jc.parameter_info(jc.case("1a")) | jc.parameter_info(jc.forces.ImpactFromBearing())
    rows = (f"| `{name}` | {of.unit} | {of.text} |" for name, of in info.items())
    return "\n".join(["| parameter | unit | meaning |", "|---|---|---|", *rows])


def block(page: str, name: str) -> str:
    """Return what a command put between the marks `name` of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return text.split(f"<!-- made: {name} -->\n")[1].split("\n<!-- end -->")[0]


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what stands elsewhere, and what is made."""
    made: dict[str, Any] = {f"api/{layer}.md": reference(layer) for layer in layers()}
    made["api/jaxcage.md"] = top_reference()
    for notebook in sorted(ROOT.glob("experiments/*.ipynb")):
        text, figures = gallery(notebook)
        made |= {f"gallery/{notebook.stem}.md": text} | {f"gallery/{name}": data for name, data in figures.items()}
    for uri, content in made.items():
        files.append(File.generated(config, uri, content=content))
    for name, uri in WRITTEN.items():
        files.append(File.generated(config, uri, abs_src_path=str(ROOT / name)))
    for figure in ROOT.glob("experiments/*.png"):
        files.append(File.generated(config, f"figures/{figure.name}", abs_src_path=str(figure)))
    return files


def _moved(link: re.Match[str]) -> str:
    """Return the place in the site of a file of the checkout."""
    path = pathlib.PurePosixPath(link["path"])
    if str(path) in PLACES:
        return f"]({PLACES[str(path)]}"
    if path.parts[0] == "docs":
        return f"]({path.relative_to('docs')}"
    if path.parts[0] == "experiments":
        return f"](figures/{path.name}" if path.suffix == ".png" else f"](gallery/{path.stem}.md"
    return link[0]


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put in what is made elsewhere, and let links point to the site's pages."""
    for name, make in {"outputs": outputs, "parameters": parameters}.items():
        if f"<!-- {name} -->" in markdown:
            markdown = markdown.replace(f"<!-- {name} -->", make())
    markdown = re.sub(r"^.*<!-- shown: (\S+) (\S+) -->$", lambda m: block(m[1], m[2]), markdown, flags=re.M)
    markdown = re.sub(r"\]\((?=(?:experiments|docs)/)", "](../", markdown)
    return re.sub(r"\]\(\.\./(?P<path>[^)#]+)", _moved, markdown)


SPACE = '<mspace width="0.17em" />'
"""Space around the name of a function in an equation."""


def _formulas(html: str) -> Iterator[str]:
    for i, part in enumerate(re.split(r'<(?:span|div) class="arithmatex">(.*?)</(?:span|div)>', html, flags=re.S)):
        if i % 2 == 0:
            yield part
        else:
            latex = part.strip().replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">")
            made = convert(latex[2:-2].strip(), display="block" if latex.startswith(r"\[") else "inline")
            made = re.sub(r'<mi mathvariant="bold">(\w)</mi>', lambda m: f"<mi>{_bold(m[1])}</mi>", made)
            made = re.sub(r"(<m[io]>(?:sin|cos|tan|ln|arccos)</m[io]>)(?=<mi>)", rf"{SPACE}\1{SPACE}", made)
            yield made.replace("<mover>", '<mover accent="true">')


def _bold(letter: str) -> str:
    """The letter of Unicode's bold alphabet: browsers do not know `mathvariant="bold"`."""
    return chr(ord(letter) + (0x1D400 - ord("A") if letter.isupper() else 0x1D41A - ord("a")))


def on_page_content(html: str, **_: Any) -> str:
    """Equations as MathML, which a browser draws by itself; options such as `--draws 0` stay on one line."""
    return re.sub(r"<code>([^<\n]{1,25}</code>)", r'<code class="short">\1', "".join(_formulas(html)))
