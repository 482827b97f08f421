"""Texts that stand in the page's scripts: what a reader would see that does not come from a catalogue."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import tree_sitter
import tree_sitter_javascript

PARSER = tree_sitter.Parser(tree_sitter.Language(tree_sitter_javascript.language()))
WORD = re.compile(r"[^\W\d_]{2,}")
# Stand for themselves in every language.
UNITS = {"mm", "px", "ms", "min", "kB", "MB", "GB", "Hz", "rms", "Touchline", "id"}
SHOWN = {
    "aria-label",
    "title",
    "placeholder",
    "alt",
    "label",
    "about",
    "aria-description",
    "aria-valuetext",
    "aria-roledescription",
}  # attributes
# properties
SAID = {"label", "short", "text", "fix", "title", "sentence", "missing", "placeholder"}
UNSEEN = {
    "class",
    "style",
    "d",
    "viewBox",
    "transform",
    "points",
    "data-testid",
    "href",
    "key",
    "sandbox",
    "font",
}
# Two words, or a word with a capital, or the end of a sentence.
PROSE = re.compile(r"[^\W\d_]{2,}[,;:.]? [^\W\d_]{2,}|^[A-Z][a-z]+\W*$|^[A-Z ].*[a-z][.…?]$")
# What may be written like a text and is none: programs, queries, addresses; names of keys, headers and errors.
NAMES = re.compile(
    r"^(#version .*|\(prefers-.*|\w+://.*|Arrow\w*|Left|Right|Up|Down|Escape|Enter|Tab|Home|End|"
    r"Page(Up|Down)|Delete|Backspace|Shift|Control|Alt|Meta|Space|Content-Type|If-Match|Location|Files|"
    r"Touchline|[A-Z]\w+Error)$",
    re.DOTALL,
)
SELECTING = re.compile(
    r"\b(querySelector|querySelectorAll|closest|matches|matchMedia|replace|includes|startsWith)$"
)
COMPARING = {"===", "!==", "in", "<", ">"}
# What is in them is not shown where they stand.
OPENING = {
    "subscript_expression",
    "member_expression",
    "arrow_function",
    "new_expression",
    "object",
    "array",
}


@dataclass
class Markup:
    """Where in the markup a template of htm is: between tags, in a tag, or in the value of an attribute."""

    state: str = "text"
    attribute: str = ""
    quote: str = ""
    # (attribute, or None: a text; what stands there)
    texts: list[tuple[str | None, str]] = field(default_factory=list)

    def read(self, markup: str) -> None:
        """Go on through a stretch of markup without values."""
        text = ""
        for sign in markup:
            if self.state == "text":
                if sign == "<":
                    self.state, self.attribute = "tag", ""
                    self.texts.append((None, text))
                    text = ""
                else:
                    text += sign
            elif self.state == "value" and self.quote:
                if sign == self.quote:
                    self.texts.append((self.attribute, text))
                    self.state, self.attribute, text = "tag", "", ""
                else:
                    text += sign
            elif sign == ">":
                self.state, self.attribute = "text", ""
            elif sign.isspace() or sign == "/":
                self.state, self.attribute = "tag", ""
            elif self.state == "tag" and sign == "=":
                self.state, self.quote = "value", ""
            elif self.state == "value" and sign in "\"'":
                self.quote, text = sign, ""
            elif self.state == "tag":
                self.attribute += sign
        if text:
            self.texts.append((self.attribute if self.state == "value" else None, text))


def texts_outside(source: str) -> Iterator[tuple[int, str]]:
    """Yield (line, text) for every text in a script that a reader would see and that no catalogue holds."""
    yield from _visit(PARSER.parse(source.encode()).root_node, "")


def _visit(node: tree_sitter.Node, place: str) -> Iterator[tuple[int, str]]:
    """place: "" in code, "seen" where a reader sees every word, "unseen" where none."""
    if node.type in ("string", "template_string"):
        yield from _literal(node, place)
    elif node.type == "call_expression":
        yield from _call(node)
    elif node.type not in ("comment", "import_statement", "throw_statement", "regex"):
        for name, child in _parts(node):
            yield from _visit(child, _place_of(node, name, place))


def _parts(node: tree_sitter.Node) -> list[tuple[str | None, tree_sitter.Node]]:
    return [(node.field_name_for_child(i), child) for i, child in enumerate(node.children)]


def _text(node: tree_sitter.Node | None) -> str:
    assert node is not None and node.text is not None
    return node.text.decode()


def _place_of(node: tree_sitter.Node, part: str | None, place: str) -> str:
    """Return what a part of an expression is to the reader, where the whole is at a place."""
    if node.type == "pair":
        name = _text(node.child_by_field_name("key")).strip("\"'")
        return (
            "" if part == "key" else "seen" if name in SAID else "unseen" if name in UNSEEN else ""
        )
    if node.type == "ternary_expression":
        return "unseen" if part == "condition" else place
    if node.type == "binary_expression":
        return "unseen" if _text(node.child_by_field_name("operator")) in COMPARING else place
    return "" if node.type in OPENING else place


def _literal(node: tree_sitter.Node, place: str) -> Iterator[tuple[int, str]]:
    for child in node.children:
        if child.type == "template_substitution":
            yield from _visit(child, place)
        elif child.type == "string_fragment" and _is_seen(_text(child), place):
            yield child.start_point[0] + 1, _text(child)


def _call(node: tree_sitter.Node) -> Iterator[tuple[int, str]]:
    called, arguments = node.child_by_field_name("function"), node.child_by_field_name("arguments")
    assert called is not None and arguments is not None
    yield from _visit(called, "")
    name = _text(called)
    if name == "html" and arguments.type == "template_string":
        yield from _markup(arguments)
    elif name == "ownWords":  # words of a feature of one file
        return
    elif not SELECTING.search(name):
        for argument in (
            arguments.children if name not in ("t", "rich") else arguments.named_children[1:]
        ):
            yield from _visit(argument, "")


def _markup(template: tree_sitter.Node) -> Iterator[tuple[int, str]]:
    markup = Markup()
    for child in template.children:
        if child.type == "template_substitution":
            yield from _visit(
                child, _place_in(markup.attribute if markup.state == "value" else None)
            )
            if markup.state == "value" and not markup.quote:  # the attribute's whole value
                markup.state, markup.attribute = "tag", ""
        elif child.type == "string_fragment":
            markup.texts.clear()
            markup.read(_text(child))
            for attribute, text in markup.texts:
                if _is_seen(text, _place_in(attribute)):
                    yield child.start_point[0] + 1, " ".join(text.split())


def _place_in(attribute: str | None) -> str:
    return (
        "seen"
        if attribute is None or attribute in SHOWN
        else "unseen"
        if attribute in UNSEEN
        else ""
    )


def _is_seen(text: str, place: str) -> bool:
    words = [word for word in WORD.findall(re.sub(r"&\w+;", "", text)) if word not in UNITS]
    if not words or place == "unseen" or NAMES.match(text.strip()):
        return False
    return place == "seen" or bool(PROSE.search(text))
