"""What Python modules import, and the circles in that."""

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path


def python_modules(folder: Path) -> dict[str, ast.Module]:
    """Parse every module below a package's folder, by its dotted name."""
    found = {}
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(folder.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = ast.parse(
            path.read_text(), str(path)
        )
    return found


def imported_names(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Each imported dotted name with its line, inside functions too; of "from a import b" it is a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno} imports relatively; write the whole name"
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


def python_graph(modules: Mapping[str, ast.Module]) -> dict[str, set[str]]:
    """The modules that each one imports, of those given."""

    def target(name: str) -> str:
        return name if name in modules else name.rpartition(".")[0]

    return {
        module: {target(name) for name, _ in imported_names(tree)} & modules.keys() - {module}
        for module, tree in modules.items()
    }


def circles(graph: Mapping) -> list[list]:
    """Every set of two or more nodes that reach each other (Tarjan's strongly connected components)."""
    index: dict = {}
    low: dict = {}
    stack: list = []
    found: list[list] = []

    def visit(node) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in index:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == index[node]:
            component = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(component) > 1:
                found.append(sorted(component))

    for node in graph:
        if node not in index:
            visit(node)
    return found
